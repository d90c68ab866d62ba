#include "scenes/road/road_layout.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "scenes/lot/marking_painter.h"
#include "vcharge_simulation/objects/car_model.h"
#include "vcharge_simulation/rendering/noise.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kKerbFace_m = 0.04;  // length of the bevel of the lowered kerb
constexpr double kKerbFrom_m = 158.0;
constexpr double kKerbTo_m = 163.0;
constexpr double kBumps_m[] = {170.0, 180.0};
constexpr double kSlopeFrom_m = 190.0;
constexpr double kSlopeTo_m = 240.0;
constexpr double kRounding_m = 4.0;

double ramp(double along_m) {
  return std::clamp(along_m, 0.0, 1.0);
}

double slopeHeight(double x) {
  // The slope changes linearly at both ends.
  const auto rise = [](double along_m) {
    const double rounded_m = std::clamp(along_m, 0.0, kRounding_m);
    return kRoadSlope * (0.5 * rounded_m * rounded_m / kRounding_m + std::max(0.0, along_m - kRounding_m));
  };
  return rise(x - kSlopeFrom_m) - rise(x - kSlopeTo_m + kRounding_m);
}

float asphalt(float x, float y, uint32_t seed) {
  float value = 0.2F * (1.0F + 0.17F * fractalNoise(x * 38.0F, y * 38.0F, 2, 0.9F, seed) +
                        0.13F * fractalNoise(x * 7.0F, y * 7.0F, 3, 0.7F, seed + 1));
  const CellNoise stones = cellNoise(x * 26.0F, y * 26.0F, seed + 2);
  if (unitFromBits(mixBits(stones.cell)) > 0.86F) {
    value *= 1.3F;
  }
  const CellNoise cracks = cellNoise(x * 0.4F + 0.2F * valueNoise(x, y, seed + 3),
                                     y * 0.4F + 0.2F * valueNoise(x, y, seed + 4), seed + 5);
  if (valueNoise(x * 0.17F, y * 0.17F, seed + 6) > -0.2F && cracks.border_distance < 0.005F) {
    value *= 0.5F;
  }
  return value;
}

float slabs(float x, float y, uint32_t seed) {
  constexpr float kSlab_m = 0.5F;
  const int row = static_cast<int>(std::floor(y / kSlab_m));
  const float along = x / kSlab_m + 0.5F * static_cast<float>(row & 1);
  const int column = static_cast<int>(std::floor(along));
  const float to_side = std::min(along - std::floor(along), 1.0F - (along - std::floor(along)));
  const float in_row = y / kSlab_m - std::floor(y / kSlab_m);
  const bool is_joint = std::min(to_side, std::min(in_row, 1.0F - in_row)) < 0.02F;
  return is_joint ? 0.14F
                  : 0.34F * (0.9F + 0.2F * cellValue(column, row, seed)) *
                        (1.0F + 0.15F * fractalNoise(x * 20.0F, y * 20.0F, 3, 0.8F, seed + 1));
}

float grass(float x, float y, uint32_t seed) {
  return 0.14F * (1.0F + 0.5F * fractalNoise(x * 9.0F, y * 9.0F, 4, 0.8F, seed));
}

}  // namespace

RoadLayout makeRoadLayout(uint64_t seed, const Day& day) {
  RoadLayout layout;
  const double south = -kRoadHalfWidth_m - kParkingDepth_m;
  const double from_x = kRoadArea.min_x + 4.0;
  layout.pavements = {{from_x, kRoadHalfWidth_m, kRoadLevelEnd_m, kRoadHalfWidth_m + kPavementWidth_m},
                      {from_x, south - kPavementWidth_m, kRoadLevelEnd_m, south}};
  Random random(seed * 91U + 3U);
  Random cars(seed * 91U + 4U + 1000U * static_cast<uint64_t>(day.number));
  for (double x = from_x + 6.0; x < kRoadLevelEnd_m - 6.0; x += 6.2) {
    if (!cars.chance(0.6)) {
      continue;
    }
    ParkedCar car{};
    car.shape = cars.index(static_cast<int>(carShapes().size()));
    car.paint = cars.index(kNumPaints);
    car.seed = static_cast<uint32_t>(cars.bits());
    car.x = x + cars.uniform(-0.3, 0.3);
    car.y = -kRoadHalfWidth_m - 0.5 * kParkingDepth_m + cars.uniform(-0.08, 0.02);
    car.yaw_rad = cars.uniform(-0.02, 0.02);
    layout.cars.push_back(car);
  }
  uint32_t number = 1;
  for (const double side : {-1.0, 1.0}) {
    const double front = side > 0.0 ? 10.5 : -12.0;
    for (double x = from_x; x < kRoadLevelEnd_m + 60.0; x += random.uniform(22.0, 34.0)) {
      const double width = random.uniform(12.0, 20.0);
      const double far = front + side * random.uniform(8.0, 11.0);
      layout.houses.push_back({{x, std::min(front, far), x + width, std::max(front, far)},
                               random.uniform(6.0, 11.0),
                               "HAUS " + std::to_string(number),
                               number});
      ++number;
    }
    const double pavement = side > 0.0 ? kRoadHalfWidth_m : -south;
    for (double x = from_x + 8.0; x < kRoadLevelEnd_m - 5.0; x += random.uniform(18.0, 26.0)) {
      layout.poles.push_back({x, side * (pavement + 0.4), kKerbHeight_m, 5.5, 0.06, true});
    }
    for (double x = from_x + 3.0; x < kRoadLevelEnd_m; x += random.uniform(9.0, 17.0)) {
      layout.trees.push_back({x, side * (pavement + kPavementWidth_m + 0.9), 0.0, random.uniform(0.6, 0.9),
                              random.uniform(0.0, 2.0 * kPi), random.index(kNumSmallTrees)});
    }
    for (double x = from_x; x < kRoadLevelEnd_m - 14.0; x += 24.0) {
      const double y = side * (pavement + kPavementWidth_m + 2.2);
      layout.hedges.push_back(
          {{x, y - 0.25, x + random.uniform(6.0, 12.0), y + 0.25}, 0.0, random.uniform(0.8, 1.5)});
    }
  }
  // Reflector posts beside the part that is not level.
  for (double x = kRoadLevelEnd_m + 6.0; x < kRoadArea.max_x - 3.0; x += 8.0) {
    for (const double side : {-1.0, 1.0}) {
      layout.poles.push_back({x, side * (kRoadHalfWidth_m + 1.0), roadHeight(x), 1.0, 0.05, false});
    }
  }
  return layout;
}

double roadHeight(double x_m) {
  double height_m = slopeHeight(x_m) + kLoweredKerb_m * (ramp((x_m - kKerbFrom_m) / kKerbFace_m) -
                                                         ramp((x_m - kKerbTo_m) / kKerbFace_m));
  for (const double bump_m : kBumps_m) {
    const double along = (x_m - bump_m) / kBumpLength_m;
    height_m += std::abs(along) < 0.5 ? 0.5 * kBumpHeight_m * (1.0 + std::cos(2.0 * kPi * along)) : 0.0;
  }
  return height_m;
}

std::vector<double> roadStations() {
  std::vector<double> xs = {kRoadArea.min_x, kRoadLevelEnd_m};
  for (const double edge_m : {kKerbFrom_m, kKerbTo_m}) {
    xs.push_back(edge_m);
    xs.push_back(edge_m + kKerbFace_m);
  }
  for (const double bump_m : kBumps_m) {
    for (int i = -10; i <= 10; ++i) {
      xs.push_back(bump_m + 0.05 * i * kBumpLength_m);
    }
  }
  for (const double end_m : {kSlopeFrom_m, kSlopeTo_m - kRounding_m}) {
    for (int i = 0; i <= 8; ++i) {
      xs.push_back(end_m + kRounding_m * i / 8.0);
    }
  }
  xs.push_back(kRoadArea.max_x);
  std::sort(xs.begin(), xs.end());
  return xs;
}

cv::Mat drawRoadGround(double texel_m, uint64_t seed) {
  MarkingPainter markings(kRoadArea, texel_m);
  markings.dashed(kRoadArea.min_x, 0.0, kRoadArea.max_x, 0.0, 0.12, 4.0, 6.0);
  markings.line(kRoadArea.min_x, -kRoadHalfWidth_m, kRoadLevelEnd_m, -kRoadHalfWidth_m, 0.1);
  Random random(seed);
  for (double x = kRoadArea.min_x + 8.0; x < kRoadArea.max_x; x += random.uniform(15.0, 40.0)) {
    markings.arrow(x, random.chance(0.5) ? -1.7 : 1.7, 0.0);
    markings.manhole(x + 5.0, random.uniform(-2.5, 2.5), 0.3);
  }
  for (const double bump_m : kBumps_m) {
    for (double y = -kRoadHalfWidth_m + 0.2; y < kRoadHalfWidth_m; y += 0.8) {
      markings.line(bump_m - 0.5, y, bump_m + 0.5, y, 0.4);
    }
  }
  cv::Mat ground(markings.image().size(), CV_8UC1);
  const auto noise_seed = static_cast<uint32_t>(seed * 6007U);
  tbb::parallel_for(0, ground.rows, [&](int row) {
    const auto y = static_cast<float>(kRoadArea.min_y + (row + 0.5) * texel_m);
    for (int column = 0; column < ground.cols; ++column) {
      const auto x = static_cast<float>(kRoadArea.min_x + (column + 0.5) * texel_m);
      const double outside = y > 0.0F ? y - kRoadHalfWidth_m : -y - kRoadHalfWidth_m - kParkingDepth_m;
      float value = outside < 0.0                ? asphalt(x, y, noise_seed)
                    : outside < kPavementWidth_m ? slabs(x, y, noise_seed + 20)
                                                 : grass(x, y, noise_seed + 40);
      value *= 1.0F + 0.2F * fractalNoise(x * 0.13F, y * 0.13F, 3, 0.6F, noise_seed + 60);
      const float paint = static_cast<float>(markings.image().at<uint8_t>(row, column)) / 255.0F;
      const float worn = paint * (0.8F + 0.2F * valueNoise(x * 9.0F, y * 9.0F, noise_seed + 61));
      value += worn * (0.6F - value);
      ground.at<uint8_t>(row, column) = cv::saturate_cast<uint8_t>(255.0F * value / kGroundLayerAlbedo);
    }
  });
  return ground;
}

}  // namespace vcharge
