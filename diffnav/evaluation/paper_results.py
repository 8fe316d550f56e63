"""What the paper printed, on its own pictures and machines; never mixed with our figures."""

from diffnav.evaluation.tables import markdown_table

NOT_OURS = "Printed in the paper, on 120 other pictures and another machine: not comparable with the rows above."
# Table 1, on 120 pictures: PSNR in dB, SSIM, seconds per image.
TABLE_1 = {
    "Dong": (13.9642, 0.4251, 0.61),
    "MF": (15.1901, 0.4921, 1.63),
    "SRIE": (11.2053, 0.3412, 58.02),
    "NPE": (15.2126, 0.4883, 6.52),
    "LightenNet": (12.8605, 0.4254, 6.08),
    "the paper's network": (21.0668, 0.6882, 0.11),
}
# Table 2, on the same pictures, turned by 180 degrees: matching points and seconds with SIFT, SURF and GMS.
TABLE_2 = {
    "Input": ((8.3, 0.09), (6.3, 0.07), (58.6, 0.04)),
    "Dong": ((5.8, 0.72), (5.0, 0.68), (54.2, 0.65)),
    "MF": ((25.5, 1.75), (34.5, 1.70), (84.8, 1.68)),
    "SRIE": ((13.7, 58.14), (11.0, 58.09), (62.6, 58.07)),
    "NPE": ((25.4, 6.63), (25.1, 6.59), (70.9, 6.57)),
    "LightenNet": ((24.5, 6.19), (24.1, 6.15), (68.8, 6.12)),
    "the paper's network": ((36.0, 0.22), (36.2, 0.18), (105.2, 0.16)),
}


def paper_table_1() -> str:
    """Table 1 in Markdown."""
    columns = ["method", "PSNR, dB", "SSIM", "s per image"]
    cells = ((name, f"{psnr:.2f}", f"{ssim:.3f}", f"{seconds:g}") for name, (psnr, ssim, seconds) in TABLE_1.items())
    return markdown_table(columns, [dict(zip(columns, line, strict=True)) for line in cells])


def paper_table_2() -> str:
    """Table 2 in Markdown."""
    columns = ["method", *(f"{matcher} {what}" for matcher in ("SIFT", "SURF", "GMS") for what in ("MP", "s"))]
    lines = []
    for name, cells in TABLE_2.items():
        values = [value for mp, seconds in cells for value in (f"{mp:.1f}", f"{seconds:.2f}")]
        lines.append(dict(zip(columns, [name, *values], strict=True)))
    return markdown_table(columns, lines)
