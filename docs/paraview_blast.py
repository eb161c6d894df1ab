"""Four linked views of a blast in ParaView, and a picture of each snapshot.

    pvpython docs/paraview_blast.py SERIES.pvd [FOLDER]
    paraview --script=docs/paraview_blast.py

Inside ParaView (also File, Load State) SERIES below is shown, and the views stay open.
"""

import math
import os
import sys

#: What is shown where no command line names it, from the folder in which ParaView was started.
SERIES = "results/blast_fracture/paraview/blast_fracture.pvd"
#: Cell values that are shown, one a view, what is written above them, and the decades of a scale
#: that has to show a wave beside fragments a thousand times as fast; 0 for an even scale.
SHOWN = {
    "displacement_m": ("displacement [m]", 4),
    "speed_m_s": ("speed [m/s]", 4),
    "damage": ("damage, 0 intact to 1 failed", 0),
    "level": ("level: step of level 0 / 2^level", 0),
}
#: Pixels of a picture: views wider than high leave room for their scales.
SIZE = [1600, 1200]
INK = [0.1, 0.1, 0.1]


def views(series):
    """Show a series in four views that share camera and time; returns their layout."""
    from paraview import simple

    source, layout = simple.PVDReader(FileName=series), simple.CreateLayout("blast")
    # Cells of a layout are the nodes of a tree: splitting cell k makes 2 k + 1 and 2 k + 2.
    layout.SplitHorizontal(0, 0.5)
    layout.SplitVertical(1, 0.5)
    layout.SplitVertical(2, 0.5)
    made = [show(source, name, *how) for name, how in SHOWN.items()]
    for cell, view in enumerate(made, 3):
        layout.AssignView(cell, view)
    for number, other in enumerate(made[1:]):
        simple.AddCameraLink(made[0], other, f"camera {number}")
    return layout


def show(source, name, words, decades):
    """A view of a series coloured by a cell value, with words above it."""
    from paraview import simple

    view = simple.CreateRenderView()
    view.UseColorPaletteForBackground, view.Background = 0, [1.0, 1.0, 1.0]
    view.OrientationAxesVisibility = 0
    shown = simple.Show(source, view)
    simple.ColorBy(shown, ("CELLS", name))
    shown.RescaleTransferFunctionToDataRangeOverTime()
    colours = simple.GetColorTransferFunction(name)
    if decades:
        most = 10.0 ** math.ceil(math.log10(colours.RGBPoints[-4]))
        colours.RescaleTransferFunction(most * 10.0**-decades, most)
        colours.MapControlPointsToLogSpace()
        colours.UseLogScale = 1
    shown.SetScalarBarVisibility(view, True)
    scale = simple.GetScalarBar(colours, view)
    scale.Title = scale.ComponentTitle = ""
    scale.LabelColor, scale.WindowLocation = INK, "Lower Right Corner"
    scale.UseCustomLabels, scale.AddRangeLabels = 1, 0
    if decades:
        scale.CustomLabels = [most * 10.0**-k for k in range(decades + 1)]
    else:
        # A level that all bodies share would leave the scale no width.
        most = max(1.0, math.ceil(colours.RGBPoints[-4]))
        colours.RescaleTransferFunction(0.0, most)
        whole = [float(k) for k in range(int(most) + 1)]
        scale.CustomLabels = [0.0, 0.5, 1.0] if name == "damage" else whole
    text = simple.Show(simple.Text(Text=words), view)
    text.Color, text.WindowLocation = INK, "Upper Center"
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
        path = os.path.join(folder, f"view_{number:04d}.png")
        simple.SaveScreenshot(path, layout, ImageResolution=SIZE)


if __name__ == "__main__":
    # Inside ParaView there is no command line of one's own.
    given = [word for word in sys.argv[1:] if not word.startswith("-")]
    chosen = given[0] if given else SERIES
    if not os.path.isfile(chosen):
        sys.exit(f"series must be the name of a .pvd file, got {chosen!r}")
    arranged = views(os.path.abspath(chosen))
    if len(given) > 1:
        write_pictures(arranged, given[1])
