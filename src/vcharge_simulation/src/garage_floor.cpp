#include <algorithm>
#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "garage_surfaces.h"
#include "marking_painter.h"
#include "vcharge_simulation/noise.h"
#include "vcharge_simulation/scene.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kLine_m = 0.12;
constexpr double kJoint_m = 7.8;

float ramp(float value, float low, float high) {
  return std::clamp((value - low) / (high - low), 0.0F, 1.0F);
}

cv::Mat drawMarkings(const GarageLayout& layout, double texel_m) {
  MarkingPainter painter(kGarageArea, texel_m);
  for (const ParkingBay& bay : layout.bays) {
    const double half_x = 0.5 * kBayWidth_m;
    const double half_y = 0.5 * kGarageBayLength_m;
    painter.line(bay.x - half_x, bay.y - half_y, bay.x - half_x, bay.y + half_y, kLine_m);
    painter.line(bay.x + half_x, bay.y - half_y, bay.x + half_x, bay.y + half_y, kLine_m);
    const double mouth = bay.yaw_rad > 0.0 ? -1.0 : 1.0;
    painter.text(std::to_string(200 + bay.number), bay.x, bay.y + mouth * (half_y - 0.4), bay.yaw_rad, 0.35);
  }
  for (const double y : {-15.5, 0.0, 15.5}) {
    painter.arrow(-17.0, y - 1.4, 0.0);
    painter.arrow(-3.0, y + 1.4, 2.0 * kHalfPi);
    painter.arrow(9.0, y - 1.4, 0.0);
    painter.dashed(-21.0, y, 21.0, y, kLine_m, 1.5, 3.0);
  }
  for (const double x : {-26.0, 26.0}) {
    painter.arrow(x + 1.4, -7.0, kHalfPi);
    painter.arrow(x - 1.4, 8.0, -kHalfPi);
    painter.dashed(x, -11.0, x, 11.0, kLine_m, 1.5, 3.0);
    // A footpath along the wall.
    const double side = x > 0.0 ? 1.0 : -1.0;
    painter.line(side * 29.4, -22.0, side * 29.4, 22.0, 0.1);
    for (double y = -21.5; y < 22.0; y += 0.9) {
      painter.line(side * 29.5, y, side * 30.3, y + 0.5, 0.1);
    }
  }
  painter.text("AUSFAHRT", 4.0, -17.0, 0.0, 0.7);
  painter.text("10", -11.0, 17.0, 2.0 * kHalfPi, 1.1);
  painter.text("P2", 26.0, -17.5, kHalfPi, 1.2);
  painter.line(-22.9, -1.4, -22.9, 1.4, 0.35);
  painter.line(22.9, -1.4, 22.9, 1.4, 0.35);
  return painter.image();
}

struct Spot {
  float x, y, half_length, half_width, cosine, sine, strength;
};

class FloorPainter {
 public:
  FloorPainter(const GarageLayout& layout, uint64_t seed) : seed_(static_cast<uint32_t>(seed * 6151U + 11U)) {
    Random random(seed + 31);
    const auto add = [&](double x, double y, double size, double strength) {
      const double yaw_rad = random.uniform(0.0, 3.14);
      spots_.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(size),
                        static_cast<float>(size * random.uniform(0.4, 1.0)),
                        static_cast<float>(std::cos(yaw_rad)), static_cast<float>(std::sin(yaw_rad)),
                        static_cast<float>(strength)});
    };
    // Engines drip where they stand.
    for (const ParkingBay& bay : layout.bays) {
      for (int i = random.index(4); i > 0; --i) {
        const double x = bay.x + random.uniform(-0.6, 0.6);
        const double y = bay.y + random.uniform(-2.0, 2.0);
        add(x, y, random.uniform(0.06, 0.4), random.uniform(-0.6, -0.2));
      }
    }
    for (int i = 0; i < 160; ++i) {
      const double x = random.uniform(kGarageArea.min_x, kGarageArea.max_x);
      const double y = random.uniform(kGarageArea.min_y, kGarageArea.max_y);
      const double size = 0.05 * std::pow(20.0, random.uniform());
      add(x, y, size, random.uniform(-0.4, 0.3));
    }
  }

  float albedo(float x, float y, float marking) const {
    float value = 0.27F;
    value *= 1.0F + 0.16F * fractalNoise(x * 0.18F, y * 0.18F, 3, 0.6F, seed_) +
             0.16F * fractalNoise(x * 1.3F, y * 1.3F, 4, 0.8F, seed_ + 2) +
             0.15F * fractalNoise(x * 6.0F, y * 6.0F, 2, 0.8F, seed_ + 7) +
             0.10F * fractalNoise(x * 17.0F, y * 17.0F, 3, 0.85F, seed_ + 3);
    // Chipped paint and grit.
    const CellNoise grains = cellNoise(x * 11.0F, y * 11.0F, seed_ + 4);
    const float grain = unitFromBits(mixBits(grains.cell));
    if (grain > 0.9F) {
      value *= 1.0F + 1.3F * (grain - 0.62F) * ramp(grains.border_distance, 0.1F, 0.3F);
    } else if (grain < 0.1F) {
      value *= 1.0F - 0.45F * ramp(grains.border_distance, 0.1F, 0.25F);
    }
    value *= tyreFactor(x, y) * crackFactor(x, y) * spotFactor(x, y);
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
  // Rubber along the lanes' wheel tracks.
  float tyreFactor(float x, float y) const {
    const float wander = 0.25F * valueNoise(x * 0.11F, y * 0.11F, seed_ + 5);
    float rubber = 0.0F;
    for (const float lane : {-15.5F, 0.0F, 15.5F}) {
      const float across = std::abs(std::abs(y - lane + wander) - 0.76F);
      rubber = std::max(rubber, std::abs(x) < 26.0F ? 1.0F - ramp(across, 0.08F, 0.3F) : 0.0F);
    }
    const float across = std::abs(std::abs(std::abs(x) - 26.0F + wander) - 0.76F);
    rubber = std::max(rubber, std::abs(y) < 16.0F ? 1.0F - ramp(across, 0.08F, 0.3F) : 0.0F);
    const float streaks = 0.7F + 0.5F * fractalNoise(x * 3.0F, y * 3.0F, 3, 0.8F, seed_ + 6);
    return 1.0F - 0.22F * rubber * streaks;
  }

  float crackFactor(float x, float y) const {
    const float presence = valueNoise(x * 0.12F, y * 0.12F, seed_ + 10);
    if (presence < 0.05F) {
      return 1.0F;
    }
    const float warp_x = x + 0.3F * fractalNoise(x * 1.6F, y * 1.6F, 3, 0.6F, seed_ + 11);
    const float warp_y = y + 0.3F * fractalNoise(x * 1.6F, y * 1.6F, 3, 0.6F, seed_ + 12);
    const float distance_m = cellNoise(warp_x * 0.4F, warp_y * 0.4F, seed_ + 13).border_distance / 0.4F;
    return 1.0F - 0.5F * (1.0F - ramp(distance_m, 0.004F, 0.014F));
  }

  float spotFactor(float x, float y) const {
    float factor = 1.0F;
    for (const Spot& spot : spots_) {
      const float dx = x - spot.x;
      const float dy = y - spot.y;
      const float reach = 1.5F * spot.half_length;
      if (std::abs(dx) > reach || std::abs(dy) > reach) {
        continue;
      }
      const float along = (dx * spot.cosine + dy * spot.sine) / spot.half_length;
      const float across = (dy * spot.cosine - dx * spot.sine) / spot.half_width;
      const float wobble =
          0.35F * fractalNoise(x * 2.4F / spot.half_length, y * 2.4F / spot.half_length, 3, 0.6F, seed_ + 15);
      const float radius = std::sqrt(along * along + across * across) + wobble;
      factor *= 1.0F + spot.strength * (1.0F - ramp(radius, 0.5F, 0.95F));
    }
    return factor;
  }

  uint32_t seed_;
  std::vector<Spot> spots_;
};

}  // namespace

cv::Mat drawGarageFloor(const GarageLayout& layout, double texel_m, uint64_t seed) {
  const cv::Mat markings = drawMarkings(layout, texel_m);
  const FloorPainter painter(layout, seed);
  cv::Mat image(markings.size(), CV_8UC1);
  tbb::parallel_for(0, image.rows, [&](int row) {
    const auto y = static_cast<float>(kGarageArea.min_y + (row + 0.5) * texel_m);
    for (int column = 0; column < image.cols; ++column) {
      const auto x = static_cast<float>(kGarageArea.min_x + (column + 0.5) * texel_m);
      const float marking = static_cast<float>(markings.at<uint8_t>(row, column)) / 255.0F;
      image.at<uint8_t>(row, column) =
          cv::saturate_cast<uint8_t>(painter.albedo(x, y, marking) * (255.0F / kGroundLayerAlbedo));
    }
  });
  return image;
}

}  // namespace vcharge
