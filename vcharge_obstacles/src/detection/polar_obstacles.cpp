#include "detection/polar_obstacles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

// Quantile of the points' heights that is the obstacle's height, robust to single wrong points.
constexpr double kTopFraction = 0.9;
// Ground is bare if this fraction of its pixels lies on it.
constexpr float kBareFraction = 0.4F;
// An obstacle behind another one on its ray needs this support.
constexpr double kMinSupportBehind = 0.5;
// Minimum weighted number of points of an obstacle, and their minimum fraction of all points of the cell.
constexpr double kMinPoints = 3.0;
constexpr double kMinObstacleFraction = 0.4;
// Minimum distance between obstacles on one ray.
constexpr double kMinSeparation_m = 0.4;
constexpr int kMaxObstaclesPerRay = 3;
// A ramp starts at an obstacle up to this height, rises to a higher one within this length, has no larger
// gap, and is steeper than the flat top of a kerb.
constexpr double kMaxRampHeight_m = 0.3;
constexpr double kMaxRampLength_m = 1.3;
constexpr double kRampGap_m = 0.4;
constexpr double kRampSlope = 0.05;
// Points higher than a ramp by this belong to the obstacle behind it.
constexpr double kRampRise_m = 0.05;
// A shorter ramp is the foot of the high obstacle, which starts this far in front of it.
constexpr double kRampLength_m = 0.3;
constexpr double kRampFoot_m = 0.1;
constexpr size_t kFewPoints = 4;

double medianOf(const std::vector<PolarPoint>& points, float PolarPoint::*member) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const PolarPoint& point : points) {
    values.push_back(point.*member);
  }
  return quantile(std::move(values), 0.5);
}

/// Weight of an observation from its confidence, the probability that its ranges are correct. The points of a
/// matching window are either all correct or all wrong, so their number does not count.
double weightOfConfidence(double confidence) {
  const auto logOdds = [](double probability) { return std::log(probability / (1.0 - probability)); };
  constexpr double kCertain = 0.999;
  return std::clamp(logOdds(std::min(confidence, kCertain)) / logOdds(kReferenceConfidence), 0.0, 1.0);
}

double meanConfidence(const std::vector<PolarPoint>& points) {
  double sum = 0.0;
  for (const PolarPoint& point : points) {
    sum += point.confidence;
  }
  return sum / static_cast<double>(points.size());
}

/// Range and height of an obstacle from the points in its cell and the two neighbouring cells.
PolarObstacle refine(int ray, const std::vector<PolarPoint>& points, double support) {
  PolarObstacle obstacle;
  obstacle.ray = ray;
  obstacle.support = std::min(1.0, support);
  const double middle_m = medianOf(points, &PolarPoint::range_m);
  const double sigma_m = medianOf(points, &PolarPoint::range_sigma_m);
  double sum = 0.0;
  double sum_range = 0.0;
  double sum_square = 0.0;
  for (const PolarPoint& point : points) {
    const double offset_m = point.range_m - middle_m;
    if (std::abs(offset_m) > 2.0 * sigma_m + 0.02) {
      continue;
    }
    const double weight = point.weight / (point.range_sigma_m * point.range_sigma_m + 1e-4);
    sum += weight;
    sum_range += weight * offset_m;
    sum_square += weight * offset_m * offset_m;
  }
  const double mean = sum_range / sum;
  const double spread_square = std::max(0.0, sum_square / sum - mean * mean);
  obstacle.range_m = middle_m + mean;
  // Errors of neighbouring ranges are correlated, so sigma is not divided by the root of their number.
  obstacle.range_sigma_m = std::sqrt(sigma_m * sigma_m + spread_square);
  std::vector<double> heights;
  for (const PolarPoint& point : points) {
    heights.push_back(point.height_m);
  }
  obstacle.bottom_m = quantile(heights, 1.0 - kTopFraction);
  obstacle.height_m = quantile(std::move(heights), kTopFraction);
  obstacle.height_sigma_m = medianOf(points, &PolarPoint::height_sigma_m);
  return obstacle;
}

/// Number of points in a cell and its two neighbours relative to the reference obstacle; empty if too few.
std::optional<double> supportOf(const PolarPoints& points, int ray, int bin, float expected,
                                double min_support) {
  const float here = points.obstacleWeight(ray, bin);
  const float nearer = points.obstacleWeight(ray, bin + 1);
  const float further = points.obstacleWeight(ray, bin - 1);
  if (here <= 0.0F || here < nearer || here <= further) {
    return std::nullopt;  // no local maximum
  }
  const float obstacle = here + nearer + further;
  const float ground = points.groundWeight(ray, bin) +
                       0.5F * (points.groundWeight(ray, bin + 1) + points.groundWeight(ray, bin - 1));
  const double support = obstacle / std::max(1.0F, expected);
  if (obstacle < kMinPoints || support < min_support ||
      obstacle < kMinObstacleFraction * (obstacle + ground)) {
    return std::nullopt;
  }
  return support;
}

/// Fraction of bare ground in the pixels around a cell, because a single cell has few. Negative if there are
/// hardly any pixels.
float bareFractionAround(const PolarGrid& grid, const std::vector<float>& free_fraction,
                         const std::vector<float>& expected_ground, int ray, int bin) {
  constexpr int kRays = 1;
  constexpr int kBins = 2;
  constexpr float kFewPixels = 5.0F;
  float bare = 0.0F;
  float expected = 0.0F;
  for (int r = ray - kRays; r <= ray + kRays; ++r) {
    for (int b = std::max(0, bin - kBins); b <= std::min(grid.numBins() - 1, bin + kBins); ++b) {
      const size_t index = grid.index(grid.wrap(r), b);
      bare += free_fraction[index] *
              (expected_ground[index] + 1.0F);  // undoes the additional pixel of fractionOf()
      expected += expected_ground[index];
    }
  }
  return expected < kFewPixels ? -1.0F : bare / expected;
}

/// Slope of a line through heights over ranges.
double slopeOf(const std::vector<PolarPoint>& points) {
  double range_m = 0.0;
  double height_m = 0.0;
  for (const PolarPoint& point : points) {
    range_m += point.range_m / static_cast<double>(points.size());
    height_m += point.height_m / static_cast<double>(points.size());
  }
  double covariance = 0.0;
  double variance = 1e-6;
  for (const PolarPoint& point : points) {
    covariance += (point.range_m - range_m) * (point.height_m - height_m);
    variance += (point.range_m - range_m) * (point.range_m - range_m);
  }
  return covariance / variance;
}

/// Whether the points of a sector rise without a gap from a low obstacle to a higher one behind it.
bool isRamp(const PolarPoints& points, const PolarObstacle& low) {
  if (low.height_m > kMaxRampHeight_m) {
    return false;
  }
  const PolarGrid& grid = points.grid();
  const auto furthest_m = static_cast<float>(low.range_m + kMaxRampLength_m);
  std::vector<PolarPoint> run = points.pointsOf(low.ray, grid.binOfInverse(1.0F / furthest_m),
                                                grid.binOfInverse(1.0F / static_cast<float>(low.range_m)));
  std::vector<double> high_m;
  for (const PolarPoint& point : run) {
    if (point.height_m > kMaxRampHeight_m + kRampRise_m) {
      high_m.push_back(point.range_m);
    }
  }
  if (high_m.size() < kFewPoints) {
    return false;
  }
  const double end_m = quantile(std::move(high_m), 0.1);
  if (end_m < low.range_m + kRampLength_m) {
    return false;
  }
  // Points of the higher obstacle are not part of the ramp.
  run.erase(std::remove_if(run.begin(), run.end(),
                           [&](const PolarPoint& point) {
                             return point.range_m < low.range_m || point.range_m > end_m - kRampFoot_m ||
                                    point.height_m > kMaxRampHeight_m + kRampRise_m;
                           }),
            run.end());
  std::sort(run.begin(), run.end(),
            [](const PolarPoint& a, const PolarPoint& b) { return a.range_m < b.range_m; });
  if (run.size() < kFewPoints || slopeOf(run) < kRampSlope) {
    return false;
  }
  double last_m = low.range_m;
  for (const PolarPoint& point : run) {
    if (point.range_m - last_m > kRampGap_m) {
      return false;
    }
    last_m = point.range_m;
  }
  return end_m - last_m <= kRampGap_m;
}

/// Weight of an obstacle; only high ones are weighted by confidence, since that of kerbs is low too.
double weightOf(const PolarObstacle& obstacle, const std::vector<PolarPoint>& points) {
  if (obstacle.is_ramp) {
    return kRampWeight;
  }
  return obstacle.height_m <= kMaxRampHeight_m ? 1.0 : weightOfConfidence(meanConfidence(points));
}

}  // namespace

void PolarPoints::sortByRay() {
  std::stable_sort(points_.begin(), points_.end(),
                   [](const PolarPoint& a, const PolarPoint& b) { return a.ray < b.ray; });
  first_of_ray_.assign(static_cast<size_t>(grid_.numRays()) + 1, 0);
  for (const PolarPoint& point : points_) {
    ++first_of_ray_[static_cast<size_t>(point.ray) + 1];
  }
  for (size_t i = 1; i < first_of_ray_.size(); ++i) {
    first_of_ray_[i] += first_of_ray_[i - 1];
  }
}

std::vector<PolarPoint> PolarPoints::pointsOf(int ray, int from_bin, int to_bin) const {
  std::vector<PolarPoint> found;
  for (size_t i = first_of_ray_[static_cast<size_t>(ray)]; i < first_of_ray_[static_cast<size_t>(ray) + 1];
       ++i) {
    if (points_[i].bin >= from_bin && points_[i].bin <= to_bin) {
      found.push_back(points_[i]);
    }
  }
  return found;
}

std::vector<PolarObstacle> findPolarObstacles(const PolarPoints& points,
                                              const std::vector<float>& expected_pixels, double min_support) {
  const PolarGrid& grid = points.grid();
  std::vector<PolarObstacle> found;
  for (int ray = 0; ray < grid.numRays(); ++ray) {
    int count = 0;
    double last_range_m = -std::numeric_limits<double>::infinity();
    for (int bin = grid.numBins() - 1; bin >= 0 && count < kMaxObstaclesPerRay; --bin) {
      if (grid.range_m(bin) < last_range_m + kMinSeparation_m) {
        continue;
      }
      const std::optional<double> support =
          supportOf(points, ray, bin, expected_pixels[grid.index(ray, bin)], min_support);
      if (support && (count == 0 || *support >= kMinSupportBehind)) {
        const std::vector<PolarPoint> here = points.pointsOf(ray, bin - 1, bin + 1);
        found.push_back(refine(ray, here, *support));
        found.back().is_ramp = isRamp(points, found.back());
        found.back().weight = weightOf(found.back(), here);
        last_range_m = found.back().range_m;
        ++count;
      }
    }
  }
  return found;
}

ObstacleScan makePolarScan(const PolarGrid& grid, const std::vector<PolarObstacle>& obstacles,
                           const std::vector<float>& free_fraction,
                           const std::vector<float>& expected_ground) {
  ObstacleScan scan = ObstacleScan::unknown(static_cast<size_t>(grid.numRays()), grid.maxRange_m());
  for (auto obstacle = obstacles.rbegin(); obstacle != obstacles.rend(); ++obstacle) {
    const auto ray = static_cast<size_t>(obstacle->ray);  // writes the first of a ray last
    scan.range_m[ray] = static_cast<float>(obstacle->range_m);
    scan.range_sigma_m[ray] = static_cast<float>(obstacle->range_sigma_m);
    scan.height_m[ray] = static_cast<float>(obstacle->height_m);
    scan.height_sigma_m[ray] = static_cast<float>(obstacle->height_sigma_m);
  }
  for (int ray = 0; ray < grid.numRays(); ++ray) {
    const float range_m = scan.range_m[static_cast<size_t>(ray)];
    for (int bin = grid.numBins() - 1; bin >= 0; --bin) {
      const float bare_fraction = bareFractionAround(grid, free_fraction, expected_ground, ray, bin);
      const double bin_range_m = grid.range_m(bin);
      if (bare_fraction < 0.0F) {
        continue;  // nearer than the range that the image shows
      }
      if (bare_fraction < kBareFraction || bin_range_m >= range_m) {
        break;
      }
      scan.free_m[static_cast<size_t>(ray)] = static_cast<float>(bin_range_m);
    }
  }
  return scan;
}

}  // namespace vcharge
