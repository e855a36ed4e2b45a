"""Cheap bodies with everything a run asks of a reduced body: report, mesh, recovery."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from cheap_bodies import body_of
from coupled import make_bodies

from flexgear.model.load import load_case
from flexgear.solve.model import assemble
from flexgear.structures.bodies import Body, rigid_motion
from flexgear.structures.estimate import largest_error
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.sources.of_case import fe_sources

REPORT = {
    "fe_dofs": 24,
    "fixed_interface_modes": 0,
    "static_error": 0.001,
    "frequency_error": 0.002,
    "frequency_limit_hz": 2000.0,
}
CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.2, 0.2)])


def cheap_stage(case):
    """Ring and carrier of springs; their FE mesh is one brick that moves with the mean motion."""
    bodies = make_bodies(case) if case.fe_bodies else {}
    return {name: reduced(body) for name, body in bodies.items()}


def doubtful_stage(case):
    """The same, the ring's reduction with a larger error than promised."""
    ring, carrier = cheap_stage(case).items()
    return {ring[0]: missing_the_promise(ring[1]), carrier[0]: carrier[1]}


def missing_the_promise(body, error=0.034) -> ReducedBody:
    """A reduction whose static error is larger than promised, under one of two loads."""
    cases = {"tip": 0.001, "tip end -z": error}
    return body.with_(report={**body.report, **largest_error(cases), "static_error_cases": cases})


def reduced(body) -> ReducedBody:
    plain = body_of(body.name, body.node_names, body.positions, body.mass, body.stiffness)
    size = len(body.mass)
    return plain.with_(
        report={**REPORT, "interface_dofs": size},
        points=CUBE,
        cells=np.arange(8)[None],
        recovery=np.zeros((24, size), dtype=np.float32),
    )


def sources_of_bodies(bodies):
    """In the place of ``fe_sources``: sources whose reduced bodies are these of a stage."""
    return lambda stage: {
        name: SimpleNamespace(reduced=lambda *_, b=body: b, fe_mesh=fe_sources(stage)[name].fe_mesh)
        for name, body in bodies(stage).items()
    }


def stiff_stage(case):
    """Ring and carrier of the size of any case, with what a run asks of reduced bodies: nodes that
    hang together by K = k S (I − R R⁺) S, which leaves their rigid motions free of force; they are
    so stiff that no frequency of theirs is below any band."""
    parts = {n: reduced(_hung_together(s.rigid())) for n, s in fe_sources(case).items()}
    return {
        name: body.with_(report={**body.report, "frequency_limit_hz": 1e6})
        for name, body in parts.items()
    }


def bodies_of(stage):
    """Cheap bodies of any stage: those of springs for the bundled one that they were made for."""
    return (cheap_stage if stage.case.name == "wind-5mw" else stiff_stage)(stage)


def _hung_together(body: Body) -> Body:
    """The mass shared by the nodes, each a ball about as far across as the body's nodes reach."""
    reach = np.abs(body.positions).max()
    weight = np.tile([1, 1, 1, *3 * [0.1 * reach]], len(body.positions))
    turning = np.broadcast_to(np.eye(6)[3:], (len(body.positions), 3, 6))
    motion = np.concatenate([rigid_motion(body.positions), turning], axis=1).reshape(-1, 6)
    motion = weight[:, None] * motion
    rest = np.eye(len(motion)) - motion @ np.linalg.pinv(motion)
    each = body.mass[0, 0] / len(body.positions)
    mass = np.diag(np.tile(each * np.array([1, 1, 1, *3 * [0.1 * reach**2]]), len(body.positions)))
    return replace(body, mass=mass, stiffness=2e11 * reach * weight[:, None] * rest * weight)


VERTICES = [6 * node + axis for node in range(8) for axis in range(3)]


def stage_with_vertices():
    """wind-5mw on cheap bodies whose vertices are their first eight nodes."""
    case = load_case("wind-5mw")
    bodies = {
        name: body.with_(
            points=body.positions[:8],
            recovery=np.eye(len(body.mass), dtype=np.float32)[VERTICES],
        )
        for name, body in cheap_stage(case.view()).items()
    }
    return assemble(case, bodies=bodies)
