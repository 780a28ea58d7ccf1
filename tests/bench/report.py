"""report.py - how the figures are printed: a heading, and rows of a value beside its bar."""


def heading(text):
    print(f"\n{text}", flush=True)


def row(what, value, bar="", met=None):
    verdict = "" if met is None else "met" if met else "MISSED"
    print(f"  {what:<48} {value:>16}  {bar:<10} {verdict}".rstrip(), flush=True)


def others(percent):
    row("others took of all cores", f"{percent:.0f} %")
