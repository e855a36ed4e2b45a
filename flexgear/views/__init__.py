"""Pictures and pages: the only package that imports matplotlib and pyvista.

Functions take labelled datasets or plain arrays in SI and return matplotlib figures; `save_figure`
writes them. 3D rendering (`flexgear.views.render`) is imported on demand.
"""
