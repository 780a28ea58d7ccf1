"""rates.py - answers a second, printed with their latencies, and what of the machine they took."""

COLUMNS = "  {:<12} {:>9} {:>7} {:>7} {:>7} {:>12} {:>12} {:>9}"
HEADINGS = ("", "answers/s", "p50 ms", "p99 ms", "max ms", "CPU us each", "to a commit", "others %")
CELLS = (("per_s", 1, 0), ("p50_us", 1e-3, 1), ("p99_us", 1e-3, 1), ("max_us", 1e-3, 1),
         ("cpu_us", 1, 0), ("group", 1, 1), ("others", 1, 0))  # fmt: skip


def show_rate(name, results):
    """Prints and gives the round with the median rate."""
    result = sorted(results, key=lambda result: result["per_s"])[len(results) // 2]
    cells = [
        f"{result[key] * scale:.{digits}f}" if key in result else "" for key, scale, digits in CELLS
    ]
    print(COLUMNS.format(name, *cells).rstrip(), flush=True)
    return result["per_s"]
