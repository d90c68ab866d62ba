#include "fusion/cell_observation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "detection/pixel_rays.h"

namespace vcharge {
namespace {

// Half diagonal of a square cell relative to its side.
constexpr double kHalfDiagonal = 0.7072;
// Ground is blocked within this number of cell sides around an obstacle, plus two sigmas of its range.
constexpr double kMarginCells = 0.75;
// A static obstacle is observed below this height. Moving objects get wrong ranges and seem to hang higher.
constexpr double kStandsBelow_m = 0.25;
// Angle by which the ground hidden by a static obstacle moves between two images, and margin in range.
constexpr double kParallax_rad = 0.09;
constexpr double kExplainedMargin_m = 0.3;
// Obstacles within these distances of each other, sideways and in range, are parts of one body.
constexpr double kGapWidth_m = 0.3;
constexpr double kGapDepth_m = 0.3;

}  // namespace

CellObserver::CellObserver(const CameraObstacles& seen, const PolarGrid& grid, double cell_m)
    : seen_(seen), grid_(grid), cell_m_(cell_m), obstacles_of_ray_(static_cast<size_t>(grid.numRays())) {
  for (const PolarObstacle& obstacle : seen.obstacles) {
    obstacles_of_ray_[static_cast<size_t>(obstacle.ray)].push_back(&obstacle);
  }
  bridgeGaps();
}

/// The nearest obstacle on a ray, if it is high enough to be part of a body above visible ground.
const PolarObstacle* CellObserver::nearestBodyOn(int ray) const {
  const auto& obstacles = obstacles_of_ray_[static_cast<size_t>(grid_.wrap(ray))];
  return obstacles.empty() || obstacles.front()->height_m <= kClearance_m ? nullptr : obstacles.front();
}

/// Closes gaps in a dark body: stereo ranges its edges, plates and lamps, but between them only the ground
/// below the body.
void CellObserver::bridgeGaps() {
  bridge_m_.assign(static_cast<size_t>(grid_.numRays()), std::numeric_limits<double>::infinity());
  for (int ray = 0; ray < grid_.numRays(); ++ray) {
    const PolarObstacle* first = nearestBodyOn(ray);
    if (first == nullptr) {
      continue;
    }
    const auto reach = static_cast<int>(kGapWidth_m / (first->range_m * grid_.increment_rad()));
    for (int step = 1; step <= reach; ++step) {
      const PolarObstacle* next = nearestBodyOn(ray + step);
      if (next == nullptr || std::abs(next->range_m - first->range_m) > kGapDepth_m) {
        continue;
      }
      for (int between = ray + 1; between < ray + step; ++between) {
        bridge_m_[static_cast<size_t>(grid_.wrap(between))] = std::min(first->range_m, next->range_m);
      }
      break;
    }
  }
}

CellObservation CellObserver::observe(double angle_rad, double range_m, int bin) const {
  const int middle = grid_.rayOf(angle_rad);
  const int spread = static_cast<int>(std::lround(kHalfDiagonal * cell_m_ / range_m / grid_.increment_rad()));
  // Close to the camera, a cell covers several bins.
  const auto binAt = [&](double at_m) { return grid_.binOfInverse(static_cast<float>(1.0 / at_m)); };
  const double reach_m = 0.5 * (cell_m_ - grid_.binWidth() * range_m * range_m);
  const int first = reach_m > 0.0 ? std::max(0, binAt(range_m + reach_m)) : bin;
  const int last =
      reach_m > 0.0 && reach_m < range_m ? std::min(grid_.numBins() - 1, binAt(range_m - reach_m)) : bin;
  CellObservation cell;
  double pixels = 0.0;
  const bool is_uniform = seen_.expected_ground.empty();
  for (int step = middle - spread; step <= middle + spread; ++step) {
    const int ray = grid_.wrap(step);
    cell.blocked = cell.blocked || blocks(ray, range_m);
    for (int each = first; each <= last; ++each) {
      const size_t index = grid_.index(ray, each);
      // The detector's fractions have one additional pixel in each denominator; here one is enough for all.
      const double expected = is_uniform ? 0.0 : seen_.expected_ground[index];
      pixels += is_uniform ? 1.0 : expected;
      cell.free_fraction += (expected + 1.0) * seen_.free_fraction[index];
      cell.hidden_fraction += (expected + 1.0) * seen_.hidden_fraction[index];
      cell.unknown_fraction += (expected + 1.0) * seen_.unknown_fraction[index];
      cell.changed_fraction += seen_.changed_fraction.empty() ? 0.0 : seen_.changed_fraction[index];
    }
  }
  const double inverse = 1.0 / (is_uniform ? pixels : pixels + 1.0);
  cell.free_fraction *= inverse;
  cell.hidden_fraction *= inverse;
  cell.unknown_fraction *= inverse;
  cell.changed_fraction /= (2 * spread + 1) * (last - first + 1);
  return cell;
}

bool CellObserver::isExplained(double angle_rad, double range_m) const {
  const int middle = grid_.rayOf(angle_rad);
  const int spread = static_cast<int>(std::ceil(kParallax_rad / grid_.increment_rad()));
  for (int step = middle - spread; step <= middle + spread; ++step) {
    for (const PolarObstacle* obstacle : obstacles_of_ray_[static_cast<size_t>(grid_.wrap(step))]) {
      if (obstacle->bottom_m < kStandsBelow_m && obstacle->range_m < range_m + kExplainedMargin_m) {
        return true;
      }
    }
  }
  return false;
}

bool CellObserver::blocks(int ray, double range_m) const {
  const double bridge_m = bridge_m_[static_cast<size_t>(ray)];
  if (bridge_m < range_m && seen_.camera_height_m * (1.0 - bridge_m / range_m) < kClearance_m) {
    return true;
  }
  for (const PolarObstacle* obstacle : obstacles_of_ray_[static_cast<size_t>(ray)]) {
    const double margin_m = kMarginCells * cell_m_ + 2.0 * obstacle->range_sigma_m;
    // If the camera cannot look over an obstacle, the ground behind it is a reflection.
    const double ray_height_m = seen_.camera_height_m * (1.0 - obstacle->range_m / range_m);
    if (std::abs(obstacle->range_m - range_m) < margin_m ||
        (obstacle->range_m < range_m && ray_height_m < obstacle->height_m)) {
      return true;
    }
  }
  return false;
}

}  // namespace vcharge
