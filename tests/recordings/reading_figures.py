"""What a figure shows, read back from its artists."""

import numpy as np


def axes_of(figure, label):
    return next(axes for axes in figure.axes if axes.get_label() == label)


def texts(figure):
    artists = [*figure.texts, *(text for axes in figure.axes for text in axes.texts)]
    return [text.get_text() for text in artists]


def titles(figure):
    return tuple(text for text in texts(figure) if text.startswith("("))


def quantities(figure):
    """The curves of all axes of a figure that show the whole run, without marks."""
    whole = [axes for axes in figure.axes if axes.get_label().endswith("whole")]
    return [
        line
        for axes in whole
        for line in axes.lines
        if len(line.get_xdata()) > 2 and line.get_linestyle() == "-"
    ]


def bars(axes, colour):
    """Beginning and end of every bar of a colour."""
    return [
        (path.vertices[:, 0].min(), path.vertices[:, 0].max())
        for collection in axes.collections
        if np.allclose(collection.get_facecolor()[0, :3], colour)
        for path in collection.get_paths()
    ]
