"""Compares two outputs of bench.sh and lists the benchmarks that became slower beyond noise; exit status 1 then.

Two machines, or one machine under different load, differ by a common factor: the median over all benchmarks, which is
divided out. Noise is the scatter of the repetitions of both runs."""
import argparse
import json
import math
import pathlib
import statistics
import sys

MIN_CHANGE = 0.10


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=pathlib.Path)
    parser.add_argument("after", type=pathlib.Path)
    parser.add_argument("--min-change", type=float, default=MIN_CHANGE, help="smaller changes are noise (default: 0.1)")
    return parser.parse_args()


def read(path):
    try:
        bench = json.loads(path.read_text())
        return {f"{name}: {case}": values["times_ns"] for name, cases in bench["benchmarks"].items()
                for case, values in cases.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise SystemExit(f"bench.sh --compare: {path}: expected JSON of bench.sh ({error})") from error


def scatter(times):
    """Robust standard deviation of the logarithms: half of the distance between the quartiles, over 0.674."""
    if len(times) < 3:
        return 0.05
    low, _, high = statistics.quantiles([math.log(time) for time in times], n=4)
    return (high - low) / 2 / 0.674


def main():
    args = arguments()
    before, after = read(args.before), read(args.after)
    common = sorted(set(before) & set(after))
    if not common:
        raise SystemExit(f"bench.sh --compare: {args.before} and {args.after} have no benchmark in common")
    changes = {name: math.log(min(after[name]) / min(before[name])) for name in common}
    shift = statistics.median(changes.values())
    worse, better = [], []
    for name in common:
        change = changes[name] - shift
        noise = max(math.log1p(args.min_change), 4 * math.hypot(scatter(before[name]), scatter(after[name])))
        if abs(change) > noise:
            (worse if change > 0 else better).append((name, change, noise))
    print(f"{len(common)} benchmarks in both; the second run took {math.exp(shift):.2f} times as long in common")
    for title, entries in (("slower", worse), ("faster", better)):
        for name, change, noise in sorted(entries, key=lambda entry: -abs(entry[1])):
            print(f"{title} {math.exp(abs(change)):.2f} times (noise {math.exp(noise):.2f}): {name}")
    for name in sorted(set(before) ^ set(after)):
        print(f"only in the {'first' if name in before else 'second'}: {name}")
    sys.exit(1 if worse else 0)


if __name__ == "__main__":
    main()
