#include "fusion/cell_look.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "detection/pixel_rays.h"

namespace vcharge {
namespace {

// Half diagonal of a square cell over its side.
constexpr double kHalfDiagonal = 0.7072;
// So many sides of a cell around an obstacle no ground is believed, besides two sigmas of its range.
constexpr double kMarginCells = 0.75;
// What stands on the ground is seen down to this height; a thing that moves is ranged where it is not, and
// seems to hang above the ground.
constexpr double kStandsBelow_m = 0.25;
// Between two images, what is hidden by a standing thing moves by so much.
constexpr double kParallax_rad = 0.09;
constexpr double kExplainedMargin_m = 0.3;
// Obstacles so near to each other, side by side and in range, are parts of one body: no vehicle passes
// between.
constexpr double kGapWidth_m = 0.3;
constexpr double kGapDepth_m = 0.3;

}  // namespace

CellLooker::CellLooker(const CameraObstacles& seen, const PolarGrid& grid, double cell_m)
    : seen_(seen), grid_(grid), cell_m_(cell_m), obstacles_of_ray_(static_cast<size_t>(grid.numRays())) {
  for (const PolarObstacle& obstacle : seen.obstacles) {
    obstacles_of_ray_[static_cast<size_t>(obstacle.ray)].push_back(&obstacle);
  }
  bridgeGaps();
}

/// The nearest obstacle on a ray, if it is so high that a body under which ground shows may be a part of it.
const PolarObstacle* CellLooker::nearestBodyOn(int ray) const {
  const auto& obstacles = obstacles_of_ray_[static_cast<size_t>(grid_.wrap(ray))];
  return obstacles.empty() || obstacles.front()->height_m <= kClearance_m ? nullptr : obstacles.front();
}

/// Of a dark body stereo sees edges, plates and lamps, and nothing between them but the ground below it.
void CellLooker::bridgeGaps() {
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

CellLook CellLooker::look(double angle_rad, double range_m, int bin) const {
  const int middle = grid_.rayOf(angle_rad);
  const int spread = static_cast<int>(std::lround(kHalfDiagonal * cell_m_ / range_m / grid_.increment_rad()));
  CellLook look;
  for (int step = middle - spread; step <= middle + spread; ++step) {
    const int ray = grid_.wrap(step);
    const size_t index = grid_.index(ray, bin);
    look.free_share += seen_.free_share[index];
    look.hidden_share += seen_.hidden_share[index];
    look.unknown_share += seen_.unknown_share[index];
    look.changed_share += seen_.changed_share.empty() ? 0.0 : seen_.changed_share[index];
    look.blocked = look.blocked || blocks(ray, range_m);
  }
  const int count = 2 * spread + 1;
  look.free_share /= count;
  look.hidden_share /= count;
  look.unknown_share /= count;
  look.changed_share /= count;
  return look;
}

bool CellLooker::isExplained(double angle_rad, double range_m) const {
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

bool CellLooker::blocks(int ray, double range_m) const {
  const double bridge_m = bridge_m_[static_cast<size_t>(ray)];
  if (bridge_m < range_m && seen_.camera_height_m * (1.0 - bridge_m / range_m) < kClearance_m) {
    return true;
  }
  for (const PolarObstacle* obstacle : obstacles_of_ray_[static_cast<size_t>(ray)]) {
    const double margin_m = kMarginCells * cell_m_ + 2.0 * obstacle->range_sigma_m;
    // Over what stands before it, ground can only be seen from higher up; else it is a mirror's.
    const double sight_m = seen_.camera_height_m * (1.0 - obstacle->range_m / range_m);
    if (std::abs(obstacle->range_m - range_m) < margin_m ||
        (obstacle->range_m < range_m && sight_m < obstacle->height_m)) {
      return true;
    }
  }
  return false;
}

}  // namespace vcharge
