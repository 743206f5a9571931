"""The words of the report, for someone who was not there."""

from __future__ import annotations

GLOSSARY = (
    ("Line laser scanner", "A laser fans out a thin sheet of light; a camera beside it sees the bright line where the "
     "sheet meets the part. Where the line is in the image tells how far away the part is (triangulation)."),
    ("Scan line", "One row of the image (or column, where the scan runs across). Each gives one position of the line, "
     "and so one 3D point."),
    ("Truth", "The exact line: the plane of the sheet cut with the part's triangles in double precision, only where "
     "the laser reaches and the camera sees it. It is computed, not taken from the image."),
    ("Error", "Measured minus true. In px along the scan line; in µm along the camera's axis (depth_z) at the same "
     "scan line; and as the distance from the point to the nearest place of the part. Positive is too far away."),
    ("Bias", "The mean error. It stays however often one measures."),
    ("Sigma", "The standard deviation of the errors about their mean: the scatter."),
    ("RMSE", "The root of the mean squared error: bias and scatter together."),
    ("Robust sigma", "The scatter as it would be without outliers: 1.4826 times the median distance from the median."),
    ("P95", "95 % of the errors are smaller in size than this."),
    ("Outliers", "Errors larger than one pixel makes, and than five robust sigma or half the line's width: wrong "
     "peaks, edges."),
    ("Lag 1", "Correlation between the errors of neighbouring scan lines. Near 0: each row errs by itself, like noise. "
     "Towards 1: they err together, through smoothing, texture or shape."),
    ("Predicted sigma", "What the extraction claims about its own error from the noise of the pixels, carried through "
     "the triangulation. Of honest claims 95.4 % of the errors lie within ±2 sigma."),
    ("Correlation length", "How many neighbouring scan lines err alike, by speckle, smoothing or a filter of two "
     "dimensions: the variance of a mean over n lines is that many times the one of independent lines."),
    ("Complete", "Share of the scan lines with a visible line on which it was found, and not as an outlier in the "
     "image: rightly measured."),
    ("px, DN, e⁻", "Pixel; digital number, the value in the image; electrons collected by a pixel."),
)  # fmt: skip
