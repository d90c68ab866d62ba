#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "scenes/garage/garage_surfaces.h"
#include "scenes/lot/marking_painter.h"
#include "vcharge_simulation/rendering/noise.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kLine_m = 0.12;
constexpr double kJoint_m = 7.8;

cv::Mat drawMarkings(const GarageLayout& layout, double texel_m) {
  const Lanes& lanes = layout.plan.lanes;
  MarkingPainter painter(layout.plan.area, texel_m);
  for (const PlannedBay& bay : layout.bays) {
    const double half_x = 0.5 * kBayWidth_m;
    const double half_y = 0.5 * kGarageBayLength_m;
    painter.line(bay.x - half_x, bay.y - half_y, bay.x - half_x, bay.y + half_y, kLine_m);
    painter.line(bay.x + half_x, bay.y - half_y, bay.x + half_x, bay.y + half_y, kLine_m);
    const double mouth = bay.yaw_rad > 0.0 ? -1.0 : 1.0;
    painter.text(std::to_string(200 + bay.number), bay.x, bay.y + mouth * (half_y - 0.4), bay.yaw_rad, 0.35);
  }
  for (const double y : {-lanes.y_m, 0.0, lanes.y_m}) {
    painter.arrow(-17.0, y - 1.4, 0.0);
    painter.arrow(-3.0, y + 1.4, 2.0 * kHalfPi);
    painter.arrow(9.0, y - 1.4, 0.0);
    painter.dashed(5.0 - lanes.x_m, y, lanes.x_m - 5.0, y, kLine_m, 1.5, 3.0);
  }
  for (const double x : {-lanes.x_m, lanes.x_m}) {
    painter.arrow(x + 1.4, -7.0, kHalfPi);
    painter.arrow(x - 1.4, 8.0, -kHalfPi);
    painter.dashed(x, -11.0, x, 11.0, kLine_m, 1.5, 3.0);
    // Footpath along the wall.
    const double side = x > 0.0 ? 1.0 : -1.0;
    const double end_y = layout.plan.area.max_y - 1.5;
    const double path_x = lanes.x_m + 3.4;
    painter.line(side * path_x, -end_y, side * path_x, end_y, 0.1);
    for (double y = 0.5 - end_y; y < end_y; y += 0.9) {
      painter.line(side * (path_x + 0.1), y, side * (path_x + 0.9), y + 0.5, 0.1);
    }
  }
  painter.text("AUSFAHRT", 4.0, -lanes.y_m - 1.5, 0.0, 0.7);
  painter.text("10", -11.0, lanes.y_m + 1.5, 2.0 * kHalfPi, 1.1);
  painter.text("P2", lanes.x_m, -lanes.y_m - 2.0, kHalfPi, 1.2);
  for (const double x : {3.1 - lanes.x_m, lanes.x_m - 3.1}) {
    painter.line(x, -1.4, x, 1.4, 0.35);
  }
  return painter.image();
}

class FloorPainter {
 public:
  FloorPainter(const Lanes& lanes, uint64_t seed)
      : lane_x_(static_cast<float>(lanes.x_m)),
        lane_y_(static_cast<float>(lanes.y_m)),
        seed_(static_cast<uint32_t>(seed * 6151U + 11U)) {}

  /// `stains` multiplies the reflectance of the clean floor; `marking` is the coverage of paint.
  float albedo(float x, float y, float stains, float marking) const {
    float value = 0.27F;
    value *= 1.0F + 0.16F * fractalNoise(x * 0.18F, y * 0.18F, 3, 0.6F, seed_) +
             0.16F * fractalNoise(x * 1.3F, y * 1.3F, 4, 0.8F, seed_ + 2) +
             0.15F * fractalNoise(x * 6.0F, y * 6.0F, 2, 0.8F, seed_ + 7) +
             0.10F * fractalNoise(x * 17.0F, y * 17.0F, 3, 0.85F, seed_ + 3);
    // The coating has chipped off, down to bright concrete or to a darker older coat.
    const float wear = fractalNoise(x * 4.5F, y * 4.5F, 5, 0.75F, seed_ + 4) +
                       0.4F * valueNoise(x * 0.35F, y * 0.35F, seed_ + 8);
    value *= 1.0F + 0.3F * ramp(wear, 0.95F, 1.02F) - 0.34F * ramp(-wear, 0.98F, 1.05F);
    value *= tyreFactor(x, y) * crackFactor(x, y) * stains;
    const auto joint = static_cast<float>(kJoint_m);
    const float to_joint =
        std::min(std::abs(x - joint * std::round(x / joint)), std::abs(y - joint * std::round(y / joint)));
    value *= 1.0F - 0.5F * (1.0F - ramp(to_joint, 0.008F, 0.016F));
    if (marking > 0.0F) {
      const float worn = fractalNoise(x * 2.5F, y * 2.5F, 4, 0.75F, seed_ + 20) +
                         0.6F * valueNoise(x * 40.0F, y * 40.0F, seed_ + 21);
      value += marking * (1.0F - ramp(worn, 0.2F, 1.0F)) * (0.6F * (0.8F + 0.2F * value / 0.27F) - value);
    }
    return value;
  }

 private:
  // Rubber along the wheel tracks of the lanes.
  float tyreFactor(float x, float y) const {
    const float wander = 0.25F * valueNoise(x * 0.11F, y * 0.11F, seed_ + 5);
    float rubber = 0.0F;
    for (const float lane : {-lane_y_, 0.0F, lane_y_}) {
      const float across = std::abs(std::abs(y - lane + wander) - 0.76F);
      rubber = std::max(rubber, std::abs(x) < lane_x_ ? 1.0F - ramp(across, 0.08F, 0.3F) : 0.0F);
    }
    const float across = std::abs(std::abs(std::abs(x) - lane_x_ + wander) - 0.76F);
    rubber = std::max(rubber, std::abs(y) < lane_y_ + 0.5F ? 1.0F - ramp(across, 0.08F, 0.3F) : 0.0F);
    const float streaks = 0.7F + 0.5F * fractalNoise(x * 3.0F, y * 3.0F, 3, 0.8F, seed_ + 6);
    return 1.0F - 0.22F * rubber * streaks;
  }

  float crackFactor(float x, float y) const {
    const float presence = valueNoise(x * 0.12F, y * 0.12F, seed_ + 10);
    if (presence < -0.15F) {
      return 1.0F;
    }
    const float warp_x = x + 0.16F * fractalNoise(x * 1.6F, y * 1.6F, 4, 0.6F, seed_ + 11);
    const float warp_y = y + 0.16F * fractalNoise(x * 1.6F, y * 1.6F, 4, 0.6F, seed_ + 12);
    const float distance_m = cellNoise(warp_x * 0.4F, warp_y * 0.4F, seed_ + 13).border_distance / 0.4F;
    return 1.0F - 0.55F * (1.0F - ramp(distance_m, 0.003F, 0.011F));
  }

  float lane_x_, lane_y_;
  uint32_t seed_;
};

}  // namespace

cv::Mat drawGarageFloor(const GarageLayout& layout, double texel_m, uint64_t seed) {
  const cv::Mat markings = drawMarkings(layout, texel_m);
  const cv::Mat stains = drawGarageStains(layout, texel_m, seed);
  const FloorPainter painter(layout.plan.lanes, seed);
  cv::Mat image(markings.size(), CV_8UC1);
  tbb::parallel_for(0, image.rows, [&](int row) {
    const auto y = static_cast<float>(layout.plan.area.min_y + (row + 0.5) * texel_m);
    for (int column = 0; column < image.cols; ++column) {
      const auto x = static_cast<float>(layout.plan.area.min_x + (column + 0.5) * texel_m);
      const float marking = static_cast<float>(markings.at<uint8_t>(row, column)) / 255.0F;
      image.at<uint8_t>(row, column) = cv::saturate_cast<uint8_t>(
          painter.albedo(x, y, stains.at<float>(row, column), marking) * (255.0F / kGroundLayerAlbedo));
    }
  });
  return image;
}

}  // namespace vcharge
