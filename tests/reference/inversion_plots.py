#!/usr/bin/env python3
"""The plots of docs/inversion.md, as SVG: fits on measured skin, residuals by band, and
the intervals of repeats.

    inversion_plots.py [FOLDER]       writes FOLDER/inversion-*.svg (docs)      5 s

Reads the measured spectra as skin_fit_choice.py does, and fits as it does; without them
it says so and ends.  Of people only four curves and quantiles are drawn.
"""

import os
import sys

import numpy as np

import skin_fit_choice as choice
from skin_fit_choice import BM, CH, CHOSEN, CHOSEN_HI, CM, NAMES, NM, ODD, SO2, start

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 400, 64, 16, 40, 48
INK, GRID, PALE = "#222", "#ddd", "#777"
FIT, PAPER, SEEN = "#1b6ca8", "#c4572b", "#222"


class Chart:
    """A pair of axes in an SVG, one of several side by side."""

    def __init__(self, box, x, y, title, names):
        self.box, self.x, self.y = box, x, y
        self.parts = ['<text x="%.1f" y="%.1f" font-weight="bold">%s</text>'
                      % (box[0], box[1] - 12, title)]
        for v in names[0]:
            at = self.at(v, y[0])
            self.line([(v, y[0]), (v, y[1])], GRID, 1)
            self.parts.append('<text x="%.1f" y="%.1f" text-anchor="middle">%g</text>'
                              % (at[0], at[1] + 16, v))
        for v in names[1]:
            at = self.at(x[0], v)
            self.line([(x[0], v), (x[1], v)], GRID, 1)
            self.parts.append('<text x="%.1f" y="%.1f" text-anchor="end">%g</text>'
                              % (at[0] - 6, at[1] + 4, v))

    def at(self, x, y):
        left, top, width, height = self.box
        return (left + width * (x - self.x[0]) / (self.x[1] - self.x[0]),
                top + height * (self.y[1] - y) / (self.y[1] - self.y[0]))

    def line(self, points, colour, width=1.6, dash=""):
        self.parts.append(
            '<polyline fill="none" stroke="%s" stroke-width="%g"%s points="%s"/>'
            % (colour, width, ' stroke-dasharray="%s"' % dash if dash else "",
               " ".join("%.1f,%.1f" % self.at(*p) for p in points)))

    def area(self, x, low, high, colour):
        points = list(zip(x, low)) + list(zip(x, high))[::-1]
        self.parts.append('<polygon fill="%s" fill-opacity="0.2" points="%s"/>'
                          % (colour, " ".join("%.1f,%.1f" % self.at(*p) for p in points)))

    def dot(self, x, y, colour, radius=2.2):
        self.parts.append('<circle cx="%.1f" cy="%.1f" r="%g" fill="%s"/>'
                          % (*self.at(x, y), radius, colour))

    def note(self, x, y, text, colour=INK, anchor="start"):
        self.parts.append('<text x="%.1f" y="%.1f" fill="%s" text-anchor="%s">%s</text>'
                          % (*self.at(x, y), colour, anchor, text))


def write(path, charts, legend, foot):
    with open(path, "w", encoding="utf-8") as f:
        f.write('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" '
                'font-family="sans-serif" font-size="12" fill="%s">\n' % (WIDTH, HEIGHT, INK))
        f.write('<rect width="%d" height="%d" fill="white"/>\n' % (WIDTH, HEIGHT))
        for chart in charts:
            f.write("\n".join(chart.parts) + "\n")
        x = LEFT
        for colour, dash, text in legend:
            f.write('<line x1="%d" x2="%d" y1="%d" y2="%d" stroke="%s" stroke-width="2"%s/>'
                    '<text x="%d" y="%d">%s</text>\n'
                    % (x, x + 24, HEIGHT - 12, HEIGHT - 12, colour,
                       ' stroke-dasharray="%s"' % dash if dash else "", x + 30, HEIGHT - 8, text))
            x += 44 + 7 * len(text)
        f.write('<text x="%d" y="%d" text-anchor="end" fill="%s">%s</text>\n</svg>\n'
                % (WIDTH - RIGHT, HEIGHT - 8, PALE, foot))
    print(path)


def fits(folder, Y, skin, paper):
    """Four people of the held-out half, from the darkest to the lightest."""
    order = ODD[np.argsort(Y[ODD].mean(1))]
    chart = Chart((LEFT, TOP, WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM - 24), (400, 700),
                  (0, 0.7), "Reflectance without the surface (0.04): four people, fitted",
                  (range(400, 701, 50), np.arange(0, 0.71, 0.1)))
    for person in order[[0, 8, 25, 48]]:
        chart.line(zip(NM, paper["R"][person]), PAPER, 1.6, "5,3")
        chart.line(zip(NM, skin["R"][person]), FIT, 1.8)
        for x, y in zip(NM, Y[person]):
            chart.dot(x, y, SEEN, 1.7)
    write(os.path.join(folder, "inversion-fits.svg"), [chart],
          [(SEEN, "1,4", "measured"), (FIT, "", "skin fit"),
           (PAPER, "5,3", "the paper's constants")], "wavelength, nm")


def residuals(folder, Y, skin, paper):
    """Median and 10..90 % of the held-out half, band by band."""
    half = (WIDTH - 2 * LEFT - RIGHT) / 2
    charts = []
    for k, (found, colour, title) in enumerate(
            ((skin, FIT, "Skin fit: measured - fitted"),
             (paper, PAPER, "The paper's constants"))):
        chart = Chart((LEFT + k * (half + LEFT), TOP, half, HEIGHT - TOP - BOTTOM - 24),
                      (400, 700), (-0.08, 0.08), title,
                      (range(400, 701, 100), np.arange(-0.08, 0.081, 0.02).round(2)))
        low, middle, high = np.quantile((Y - found["R"])[ODD], (0.1, 0.5, 0.9), axis=0)
        chart.area(NM, low, high, colour)
        chart.line(zip(NM, middle), colour)
        charts.append(chart)
    write(os.path.join(folder, "inversion-residuals.svg"), charts,
          [(INK, "", "median of 50 people; shaded: 80 % of them")], "wavelength, nm")


def repeats(folder, Y, each, skin):
    """What three placements say of Cm, Ch, SO2, and the 95 % of one: thirteen people."""
    singly = choice.each_repeat(skin, each)["x"].reshape(100, 3, 7)
    apart = each - each.mean(1, keepdims=True)
    C = choice.covariance(choice.SIZES, choice.shapes_of(skin, choice.NOISE))
    V = choice.propagated(skin, C) * choice.own_factor(C, apart, choice.NU)[:, None]
    order = ODD[np.argsort(skin["x"][ODD, CM])][::4]
    third, charts = (WIDTH - 3 * LEFT - RIGHT) / 3, []
    for k, (i, top, step) in enumerate(((CM, 0.16, 0.02), (CH, 0.28, 0.04), (SO2, 1.0, 0.2))):
        chart = Chart((LEFT + k * (third + LEFT), TOP, third, HEIGHT - TOP - BOTTOM - 24),
                      (0, len(order) + 1), (0, top), NAMES[i],
                      ((), np.arange(0, top + 1e-9, step).round(2)))
        for at, person in enumerate(order, 1):
            middle = singly[person, :, i].mean()
            wide = 1.96 * np.sqrt(V[person, CHOSEN.index(i)])
            chart.line([(at, max(middle - wide, 0)), (at, min(middle + wide, top))], FIT, 5)
            for value in singly[person, :, i]:
                chart.dot(at, value, SEEN, 2)
        charts.append(chart)
    write(os.path.join(folder, "inversion-repeats.svg"), charts,
          [(FIT, "", "95 % of one placement"), (SEEN, "1,4", "three placements")],
          "people by melanin")


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else "docs"
    if not os.path.exists(os.path.join(choice.MEASURED, "nist_forearm_avg_10nm.csv")):
        print("no measured skin in %s: set SKINSPEC_MEASURED; nothing was drawn" % choice.MEASURED)
        return 0
    Y, each = choice.measured()
    skin = choice.fit(Y, start(), CHOSEN, hi=CHOSEN_HI)
    paper = choice.fit(Y, start(Bm=0.5), [CM, BM, CH], "paper")
    fits(folder, Y, skin, paper)
    residuals(folder, Y, skin, paper)
    repeats(folder, Y, each, skin)
    return 0


if __name__ == "__main__":
    sys.exit(main())
