"""Whether localization's covariances are honest: normalized errors squared over many short drives in one map, and how often
poses are right against the probability that their covariance gives."""
import numpy as np

from vcharge_evaluation.drives import OTHER_DAY, Drive
from vcharge_evaluation.results import Figure, calibration_figures, figure
from vcharge_evaluation.tools import say

RIGHT_M, RIGHT_DEG = 0.1, 1.0
DOF = 3  # x, y and heading
DURATION_S, STEP = 4.0, 2
NORMAL_QUANTILE = 1.959964  # of 97.5 %
SAMPLES = 1000
BINS = 10


def chi_square_interval(dof):
    """Interval that holds a chi-square variable over its degrees of freedom with 95 % (Wilson and Hilferty, "The distribution
    of chi-square", PNAS 1931)."""
    spread = 2.0 / (9.0 * dof)
    return tuple((1.0 - spread + sign * NORMAL_QUANTILE * spread**0.5) ** 3 for sign in (-1.0, 1.0))


def probability_right(covariance, generator):
    """Probability that a pose with this covariance (6 x 6, translation and rotation vector) is within 0.1 m and 1 degree."""
    values, vectors = np.linalg.eigh(covariance)
    errors = (generator.standard_normal((SAMPLES, 6)) * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    right = (np.linalg.norm(errors[:, :3], axis=1) <= RIGHT_M) & (np.linalg.norm(errors[:, 3:], axis=1) <= np.radians(RIGHT_DEG))
    return float(right.mean())


def calibration(confidences, right):
    """Bins of confidence and expected calibration error, as the C++ judges write them."""
    confidences, right = np.asarray(confidences, float), np.asarray(right, bool)
    index = np.minimum((confidences * BINS).astype(int), BINS - 1)
    bins = [{"count": int(chosen.sum()), "mean_confidence": float(confidences[chosen].mean()),
             "fraction_right": float(right[chosen].mean())}
            for chosen in (index == i for i in range(BINS)) if chosen.any()]
    total = max(1, len(confidences))
    return {"expected_calibration_error": sum(one["count"] * abs(one["mean_confidence"] - one["fraction_right"])
                                              for one in bins) / total, "bins": bins}


def squared_figures(by_drive):
    """Figures of the normalized errors squared per degree of freedom; by_drive: name of each drive and its values."""
    values = [value for one in by_drive.values() for value in one]
    if not values:
        return [figure("mean normalized error squared per degree of freedom", None, at_least=0.5, at_most=2.0)]
    low, high = chi_square_interval(DOF * len(values))
    worst = max((name for name in by_drive if by_drive[name]), key=lambda name: np.mean(by_drive[name]))
    return [figure("mean normalized error squared per degree of freedom", float(np.mean(values)), at_least=0.5, at_most=2.0),
            Figure("95 % of honest covariances give (chi-square)", f"{low:.2f} to {high:.2f}"),
            Figure("drives; frames two seconds apart", f"{len(by_drive)}; {len(values)}"),
            Figure("mean of the worst drive", f"{np.mean(by_drive[worst]):.3g} ({worst})")]


def evaluate(args, maps, localize, results):
    """`maps` by scene; localize(args, drive, map, name) localizes a drive."""
    for scene, mapped in maps.items():
        generator = np.random.default_rng(args.seed)
        squares, confidences, right, lost = {}, [], [], 0
        for number in range(args.consistency):
            drive = Drive(args.work, f"{scene}_consistency", "--scene", scene, *OTHER_DAY, "--scene-seed", args.seed, "--seed",
                          args.seed + 400 + number, "--image-scale", args.image_scale, "--image-step", STEP, "--duration-s",
                          args.duration_s or DURATION_S)
            found = localize(args, drive, mapped, "localized")
            squares[f"seed {args.seed + 400 + number}"] = found.apart()
            good = np.flatnonzero(found.localized())
            lost += len(found.status) - len(good)
            confidences += [probability_right(found.covariance[i], generator) for i in good]
            right += [bool(found.error_m[i] <= RIGHT_M and found.error_deg[i] <= RIGHT_DEG) for i in good]
        say(f"{scene}: {len(right)} poses")
        condition = f"{scene}, seed {args.seed}, {args.consistency} drives of {args.duration_s or DURATION_S:g} s, " \
                    f"image scale {args.image_scale:g}"
        results.add("Covariances: errors over standard deviations", (condition, [
            *squared_figures(squares), Figure("frames not localized (not judged here)", lost),
            Figure("masks", mapped.masks.text())]))
        results.add("Confidence, by the covariance, of poses within 0.1 m and 1 degree",
                    (condition, calibration_figures(calibration(confidences, right))))
