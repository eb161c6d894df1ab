"""Four linked views of a blast in ParaView, and a picture of each snapshot.

    pvpython docs/paraview_blast.py SERIES.pvd [FOLDER]

Inside ParaView (View, Python Shell, Run Script) set SERIES first; the views stay open.
"""

import os
import sys

#: Cell values that are shown, one a view, and what is written above them.
SHOWN = {
    "displacement_m": "displacement [m]",
    "speed_m_s": "speed [m/s]",
    "damage": "damage, 0 intact to 1 failed",
    "level": "level: step dt0 / 2^level",
}


def views(series):
    """Show a series in four views that share camera and time; returns their layout."""
    from paraview import simple

    source, layout = simple.PVDReader(FileName=series), simple.CreateLayout("blast")
    # Cells of a layout are the nodes of a tree: splitting cell k makes 2 k + 1 and 2 k + 2.
    layout.SplitHorizontal(0, 0.5)
    layout.SplitVertical(1, 0.5)
    layout.SplitVertical(2, 0.5)
    made = [show(source, *item) for item in SHOWN.items()]
    for cell, view in enumerate(made, 3):
        layout.AssignView(cell, view)
    for number, other in enumerate(made[1:]):
        simple.AddCameraLink(made[0], other, f"camera {number}")
    return layout


def show(source, name, words):
    """A view of a series coloured by a cell value, with words above it."""
    from paraview import simple

    view = simple.CreateRenderView()
    shown = simple.Show(source, view)
    simple.ColorBy(shown, ("CELLS", name))
    shown.RescaleTransferFunctionToDataRangeOverTime()
    shown.SetScalarBarVisibility(view, True)
    simple.Show(simple.Text(Text=words), view)
    view.ResetCamera()
    return view


def write_pictures(layout, folder):
    """A PNG of the layout at every time of the series."""
    from paraview import simple

    os.makedirs(folder, exist_ok=True)
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    for number, time in enumerate(simple.GetTimeKeeper().TimestepValues):
        scene.AnimationTime = time
        simple.SaveScreenshot(os.path.join(folder, f"view_{number:04d}.png"), layout)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("Give the series: pvpython docs/paraview_blast.py SERIES.pvd [FOLDER]")
    arranged = views(sys.argv[1])
    if len(sys.argv) > 2:
        write_pictures(arranged, sys.argv[2])
