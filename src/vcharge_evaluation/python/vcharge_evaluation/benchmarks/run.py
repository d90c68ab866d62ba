"""Runs the suite's benchmarks and prints their figures as ratios within the run; see scripts/bench.sh."""
import argparse
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time

from vcharge_evaluation.tools import ROOT, TOOLS, say, tool_path

BENCHMARKS = {
    "solver_benchmark": "vcharge_geometry",
    "features_benchmark": "vcharge_features",
    "sparse_map_file_benchmark": "vcharge_core",
    "localization_benchmark": "vcharge_localization",
    "height_map_benchmark": "vcharge_dense",
    "plane_sweep_benchmark": "vcharge_dense",
    "render_benchmark": "vcharge_simulation",
    "bundle_benchmark": "vcharge_reconstruction",
}
SLOW = ("plane_sweep_benchmark", "render_benchmark")

# Name, benchmark, the slower case (peer, plain, one core) and the faster one: of the time per item where both count items. Cases
# that the machine or the build lacks are left out.
RATIOS = (
    ("two-point motion against OpenGV's 17-point", "solver_benchmark", "opengvSeventeenPoint", "ackermannTwoPoint"),
    ("two-point motion against OpenGV's six-point", "solver_benchmark", "opengvSixPoint", "ackermannTwoPoint"),
    ("pose of the rig from three points against OpenGV's", "solver_benchmark", "opengvGeneralizedThreePoint",
     "generalizedThreePoint"),
    ("binary descriptors' search against OpenCV, AVX-512", "features_benchmark", "searchByOpenCv/binary/1000",
     "search/binary_avx512/1000"),
    ("binary descriptors' search against OpenCV, AVX2", "features_benchmark", "searchByOpenCv/binary/1000",
     "search/binary_avx2/1000"),
    ("float descriptors' search against OpenCV, AVX-512", "features_benchmark", "searchByOpenCv/float128/1000",
     "search/float128_avx512/1000"),
    ("float descriptors' search against OpenCV, AVX2", "features_benchmark", "searchByOpenCv/float128/1000",
     "search/float128_avx2/1000"),
    ("eight Huber-TV iterations against the plain loop, one core", "height_map_benchmark", "BM_HuberIterationPlain",
     "BM_HuberIteration/1/process_time/real_time"),
    ("fusion of 300 range maps over 75 (linear: 4)", "height_map_benchmark",
     "BM_Fusion/300/60/iterations:1/process_time/real_time", "BM_Fusion/75/60/iterations:1/process_time/real_time"),
    ("range map with 4 neighbours, one core over two", "plane_sweep_benchmark",
     "rangeMap/whole_of_4/1/process_time/real_time", "rangeMap/whole_of_4/2/process_time/real_time"),
    ("range map with 2 neighbours, one core over two", "plane_sweep_benchmark",
     "rangeMap/whole_of_2/1/process_time/real_time", "rangeMap/whole_of_2/2/process_time/real_time"),
    ("plane by plane and pixel by pixel against the kernel, per sample, AVX-512", "plane_sweep_benchmark", "plain/iterations:1",
     "kernel/avx3_fisheye"),
    ("plane by plane and pixel by pixel against the kernel, per sample, AVX2", "plane_sweep_benchmark", "plain/iterations:1",
     "kernel/avx2_fisheye"),
    ("kernel over the time of its gathers alone, per sample, AVX-512", "plane_sweep_benchmark", "kernel/avx3_fisheye",
     "gather/avx3"),
    ("kernel over the time of its gathers alone, per sample, AVX2", "plane_sweep_benchmark", "kernel/avx2_fisheye",
     "gather/avx2"),
    ("range map from all planes over one that remembers", "plane_sweep_benchmark",
     "fastRangeMap/all_planes/1/process_time/real_time", "fastRangeMap/remembering/1/process_time/real_time"),
    ("range map with a coarse pass over one that remembers", "plane_sweep_benchmark",
     "fastRangeMap/coarse_pass/1/process_time/real_time", "fastRangeMap/remembering/1/process_time/real_time"),
    ("fisheye kernel against pinhole (1: costs nothing), AVX-512", "plane_sweep_benchmark",
     "kernel/avx3_fisheye", "kernel/avx3_pinhole"),
    ("fisheye kernel against pinhole (1: costs nothing), AVX2", "plane_sweep_benchmark",
     "kernel/avx2_fisheye", "kernel/avx2_pinhole"),
    ("search of the whole map over a guided one", "localization_benchmark", "wholeMap/process_time/real_time",
     "guidedSearch/process_time/real_time"),
    ("adjustment of a map against Ceres, one core", "bundle_benchmark", "ceres", "solveBundle/one core"),
    ("adjustment of a map against Ceres, two cores", "bundle_benchmark", "ceres", "solveBundle/all cores"),
)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", "--output", dest="output", type=pathlib.Path, default=ROOT / "build" / "bench.json",
                        help="JSON to write")
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help=f"without {', '.join(SLOW)}")
    parser.add_argument("benchmarks", nargs="*", help="names, default: all")
    args = parser.parse_args()
    unknown = set(args.benchmarks) - set(BENCHMARKS)
    if unknown:
        parser.error(f"unknown benchmark '{min(unknown)}': expected {', '.join(BENCHMARKS)}")
    if not args.benchmarks:
        args.benchmarks = [name for name in BENCHMARKS if not (args.quick and name in SLOW)]
    return args


def measure(name, repetitions):
    """Times (ns, one per repetition) of each case of a benchmark, with their median and minimum."""
    path = TOOLS / BENCHMARKS[name] / name
    if not path.exists():
        say(f"{name}: not built (Google Benchmark or a peer is missing)")
        return {}
    with tempfile.TemporaryDirectory() as folder:
        output = pathlib.Path(folder) / "out.json"
        subprocess.run([path, f"--benchmark_out={output}", "--benchmark_out_format=json",
                        f"--benchmark_repetitions={repetitions}", "--benchmark_min_time=0.1"],
                       stdout=subprocess.DEVNULL, check=True)
        entries = json.loads(output.read_text())["benchmarks"]
    units = {"ns": 1.0, "us": 1e3, "ms": 1e6, "s": 1e9}
    cases = {}
    for entry in entries:
        if entry.get("run_type", "iteration") != "iteration" or entry.get("error_occurred"):
            continue
        # Processor time is steadier than wall time, but does not serve for several cores or a kernel's own clock.
        by_wall = "real_time" in entry["name"] or "manual_time" in entry["name"]
        case = cases.setdefault(entry["run_name"], {"times_ns": []})
        case["times_ns"].append(entry["real_time" if by_wall else "cpu_time"] * units[entry["time_unit"]])
        if "items_per_second" in entry:
            case["least_ns_per_item"] = min(1e9 / entry["items_per_second"], case.get("least_ns_per_item", float("inf")))
    for case in cases.values():
        case["median_ns"] = statistics.median(case["times_ns"])
        case["least_ns"] = min(case["times_ns"])
    return cases


def measure_adjustment(repetitions):
    """Times (ns) of the adjustment of a map with exact observations, and of the same problem in Ceres."""
    keys = {"solveBundle/one core": "solve_bundle_s", "solveBundle/all cores": "solve_bundle_wall_s", "ceres": "ceres_s"}
    times_ns = {case: [] for case in keys}
    with tempfile.TemporaryDirectory() as folder:
        drive_map, output = pathlib.Path(folder) / "map.vmap", pathlib.Path(folder) / "out.json"
        subprocess.run([tool_path("write_analytic_map"), "--output", drive_map, "--keyframes", "300", "--landmarks", "6000"],
                       stdout=subprocess.DEVNULL, check=True)
        for _ in range(repetitions):
            subprocess.run([tool_path("bundle_benchmark"), "--map", drive_map, "--json", output], stdout=subprocess.DEVNULL,
                           check=True)
            found = json.loads(output.read_text())
            for case, key in keys.items():
                times_ns[case].append(1e9 * found[key])
    return {case: {"times_ns": times, "median_ns": statistics.median(times), "least_ns": min(times)}
            for case, times in times_ns.items()}


def readable(nanoseconds):
    for unit, size in (("s", 1e9), ("ms", 1e6), ("us", 1e3)):
        if nanoseconds >= size:
            return f"{nanoseconds / size:.3g} {unit}"
    return f"{nanoseconds:.3g} ns"


def main():
    args = arguments()
    result = {"machine": {"processor": platform.processor() or platform.machine(), "cores": os.cpu_count(),
                          "load_before": os.getloadavg()[0]},
              "time": time.strftime("%Y-%m-%dT%H:%M:%S"), "benchmarks": {}, "ratios": {}}
    for name in args.benchmarks:
        say(name)
        result["benchmarks"][name] = (measure_adjustment(args.repetitions) if name == "bundle_benchmark" else
                                      measure(name, args.repetitions))
    result["machine"]["load_after"] = os.getloadavg()[0]
    rows = []
    for label, name, slower, faster in RATIOS:
        cases = result["benchmarks"].get(name, {})
        if slower in cases and faster in cases:
            # The fastest repetition was disturbed least by other work of the machine.
            both = (cases[slower], cases[faster])
            key = "least_ns_per_item" if all("least_ns_per_item" in case for case in both) else "least_ns"
            ratio = both[0][key] / both[1][key]
            result["ratios"][label] = ratio
            rows.append((label, f"{ratio:.2f}", readable(both[0][key]), readable(both[1][key])))
    temporary = args.output.with_suffix(".tmp")
    args.output.parent.mkdir(parents=True, exist_ok=True)
    temporary.write_text(json.dumps(result, indent=1))
    temporary.rename(args.output)
    print("| what | ratio | of | to |\n|---|---|---|---|")
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print(f"written: {args.output}", file=sys.stderr)


if __name__ == "__main__":
    main()
