"""What is in a picture, for tests of pictures."""

import io
import warnings


def drawn(figure):
    """Render without a single warning, which is when matplotlib finds most faults; its axes."""
    picture = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure.savefig(picture, dpi=40)
    assert picture.tell() > 3000
    return figure.axes


def legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def named(ax, start):
    return next(line for line in ax.get_lines() if str(line.get_label()).startswith(start))
