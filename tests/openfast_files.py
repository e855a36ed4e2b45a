"""Writes output files of OpenFAST by the format that its manual and readers describe."""

import struct

import numpy as np

UNITS = {"Time": "s", "RotTorq": "kN-m", "RotSpeed": "rpm", "LSSGagMys": "kN-m",
         "LSSGagMzs": "kN-m", "Azimuth": "deg", "GenPwr": "kW"}  # fmt: skip


def write_out(path, columns, units=None, cut=None):
    """Text file; columns: values by name, Time first; cut: length in characters."""
    units = UNITS | (units or {})
    lines = ["", "Predictions were generated on 26-Nov-2026", "", "", "", ""]
    lines.append("\t".join(f"{name:>10}" for name in columns))
    lines.append("\t".join(f"{f'({units[name]})':>10}" for name in columns))
    rows = np.column_stack(list(columns.values()))
    lines += ["\t".join(f"{value:.8E}" for value in row) for row in rows]
    path.write_text(("\n".join(lines) + "\n")[:cut])


def write_outb(path, columns, form=4, units=None, cut=None):
    """Binary file of form 1, 2, 3 or 4; cut: length in bytes."""
    units = UNITS | (units or {})
    names, time = list(columns), np.asarray(columns["Time"], float)
    data = np.column_stack([columns[name] for name in names[1:]]).astype(float)
    low, span = data.min(axis=0), np.ptp(data, axis=0)
    span[span == 0] = 1.0
    slope = (65535.0 / span).astype("<f4")
    offset = (-32768.0 - low * slope).astype("<f4")
    length = 12 if form == 4 else 10
    head = struct.pack("<h", form) + (struct.pack("<h", length) if form == 4 else b"")
    head += struct.pack("<ii", data.shape[1], len(time))
    if form == 1:
        time_slope = 2e9 / (time[-1] - time[0])
        time_offset = -1e9 - time[0] * time_slope
        head += struct.pack("<dd", time_slope, time_offset)
    else:
        head += struct.pack("<dd", time[0], time[1] - time[0])
    if form != 3:
        head += slope.tobytes() + offset.tobytes()
    head += struct.pack("<i", 5) + b"tests"
    head += b"".join(name.encode().ljust(length) for name in names)
    head += b"".join(f"({units[name]})".encode().ljust(length) for name in names)
    if form == 1:
        head += np.round(time * time_slope + time_offset).astype("<i4").tobytes()
    packed = data.astype("<f8")
    if form != 3:
        packed = np.clip(np.round(data * slope + offset), -32768, 32767).astype("<i2")
    path.write_bytes((head + packed.tobytes())[:cut])
