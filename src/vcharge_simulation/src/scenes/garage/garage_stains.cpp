#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "scenes/garage/garage_surfaces.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kTrack_m = 1.5;  // track width of the cars that leave tyre marks

// Seed from a coordinate that may be negative; goes through int64_t because converting a negative double to
// unsigned is undefined.
uint32_t wrapped(double value) {
  return static_cast<uint32_t>(static_cast<int64_t>(value));
}

// An ellipse with a ragged border: reflectance changes by the fraction `strength` inside and additionally by
// `rim` at the border.
struct Blob {
  double x, y, half_length, half_width, yaw_rad;
  double strength;
  double rim = 0.0;
};

class StainPainter {
 public:
  StainPainter(const GaragePlan& plan, double texel_m, uint64_t seed)
      : plan_(plan),
        area_(plan.area),
        texel_m_(texel_m),
        seed_(static_cast<uint32_t>(seed * 733U + 5U)),
        random_(seed + 31U),
        image_(static_cast<int>(std::lround(area_.depth() / texel_m)),
               static_cast<int>(std::lround(area_.width() / texel_m)), CV_32FC1, cv::Scalar(1.0)) {}

  const cv::Mat& image() const { return image_; }

  void addOil(const std::vector<PlannedBay>& bays) {
    // Oil drips from parked engines: pools with drops around them.
    for (const PlannedBay& bay : bays) {
      for (int i = random_.index(4); i > 0; --i) {
        const double x = bay.x + random_.uniform(-0.6, 0.6);
        const double y = bay.y + random_.uniform(-2.0, 2.0);
        const double size_m = random_.uniform(0.06, 0.4);
        const double strength = random_.uniform(-0.65, -0.25);
        blob(x, y, size_m, random_.uniform(0.4, 1.0), strength);
        for (int drop = random_.index(16); drop > 0; --drop) {
          const double away_m = size_m * random_.uniform(0.8, 2.5);
          const double around_rad = random_.uniform(0.0, 2.0 * kPi);
          const double drop_m = 0.008 * std::pow(4.0, random_.uniform());
          blob(x + away_m * std::cos(around_rad), y + away_m * std::sin(around_rad), drop_m, 0.8, strength);
        }
      }
    }
  }

  void addStains() {
    // Rust, dirt and cleaned spots of all sizes.
    anywhere(220, [&](double x, double y) {
      const double size_m = 0.05 * std::pow(20.0, random_.uniform());
      blob(x, y, size_m, random_.uniform(0.4, 1.0), random_.uniform(-0.45, 0.3));
    });
    // Lime around dried puddles.
    anywhere(90, [&](double x, double y) {
      const double size_m = random_.uniform(0.2, 1.1);
      const double aspect = random_.uniform(0.4, 1.0);
      const double strength = random_.uniform(-0.12, 0.05);
      blob(x, y, size_m, aspect, strength, random_.uniform(0.1, 0.35));
    });
  }

  // Chewing gum and drops, dark when old; stones, leaves and bits of paper.
  void addSpecks() {
    anywhere(9000, [&](double x, double y) {
      const double size_m = 0.010 * std::pow(2.5, random_.uniform());
      blob(x, y, size_m, random_.uniform(0.6, 1.0), random_.uniform(-0.6, -0.2));
    });
    anywhere(3000, [&](double x, double y) {
      const double size_m = 0.008 * std::pow(3.0, random_.uniform());
      const double aspect = random_.uniform(0.35, 1.0);
      blob(x, y, size_m, aspect,
           random_.chance(0.6) ? random_.uniform(0.3, 1.1) : random_.uniform(-0.7, -0.4));
    });
  }

  void addPatches() {
    anywhere(55, [&](double x, double y) {
      const double half_x = 0.5 * random_.uniform(0.3, 1.6);
      const double half_y = 0.5 * random_.uniform(0.3, 1.2);
      const double tone = random_.uniform(-0.22, 0.22);
      const cv::Rect outer = texels(x - half_x, y - half_y, x + half_x, y + half_y);
      const int seam = std::max(1, static_cast<int>(std::lround(0.012 / texel_m_)));
      const cv::Rect inner(outer.x + seam, outer.y + seam, outer.width - 2 * seam, outer.height - 2 * seam);
      if (inner.width > 0 && inner.height > 0) {
        image_(outer) *= 0.62;
        image_(inner) *= (1.0 + tone) / 0.62;
      }
    });
  }

  // Tyre marks of cars that turned from the lane into a bay or out of it.
  void addTyreMarks(const std::vector<PlannedBay>& bays) {
    for (const PlannedBay& bay : bays) {
      const double lane_y = nearestLane(bay);
      const double towards = bay.y > lane_y ? 1.0 : -1.0;
      for (int i = random_.index(4); i > 0; --i) {
        const double side = random_.chance(0.5) ? 1.0 : -1.0;
        const double radius_m = random_.uniform(4.2, 6.0);
        const double middle_x = bay.x + random_.uniform(-0.35, 0.35) - side * radius_m;
        const double middle_y = lane_y + random_.uniform(-0.8, 0.8) + towards * radius_m;
        const double from_rad = random_.uniform(0.0, 0.7);
        const double to_rad = from_rad + random_.uniform(0.35, 0.5 * kPi);
        const double strength = random_.uniform(0.1, 0.34);
        for (const double wheel : {-0.5, 0.5}) {
          arc(middle_x, middle_y, radius_m + wheel * kTrack_m, side, towards, from_rad,
              std::min(to_rad, 0.5 * kPi), strength);
        }
      }
    }
  }

 private:
  template <class Add>
  void anywhere(int count, const Add& add) {
    for (int i = 0; i < count; ++i) {
      const double x = random_.uniform(area_.min_x, area_.max_x);
      const double y = random_.uniform(area_.min_y, area_.max_y);
      add(x, y);
    }
  }

  double nearestLane(const PlannedBay& bay) const {
    // The open end of a bay is opposite to the direction of its yaw.
    const double mouth_y = bay.y - (bay.yaw_rad > 0.0 ? 0.5 : -0.5) * kGarageBayLength_m;
    const double lanes[] = {-plan_.lanes.y_m, 0.0, plan_.lanes.y_m};
    return *std::min_element(std::begin(lanes), std::end(lanes), [&](double a, double b) {
      return std::abs(a - mouth_y) < std::abs(b - mouth_y);
    });
  }

  cv::Rect texels(double min_x, double min_y, double max_x, double max_y) const {
    const auto texel = [&](double metres, double origin_m) {
      return static_cast<int>(std::floor((metres - origin_m) / texel_m_));
    };
    const cv::Point low(texel(min_x, area_.min_x), texel(min_y, area_.min_y));
    const cv::Point high(texel(max_x, area_.min_x) + 1, texel(max_y, area_.min_y) + 1);
    return cv::Rect(low, high) & cv::Rect(0, 0, image_.cols, image_.rows);
  }

  void blob(double x, double y, double size_m, double aspect, double strength, double rim = 0.0) {
    const double yaw_rad = random_.uniform(0.0, kPi);
    draw({x, y, size_m, size_m * aspect, yaw_rad, strength, rim});
  }

  void draw(const Blob& blob) {
    const double reach = 1.5 * blob.half_length + texel_m_;
    const cv::Rect box = texels(blob.x - reach, blob.y - reach, blob.x + reach, blob.y + reach);
    const auto cosine = static_cast<float>(std::cos(blob.yaw_rad));
    const auto sine = static_cast<float>(std::sin(blob.yaw_rad));
    const auto half_length = static_cast<float>(blob.half_length);
    const auto half_width = static_cast<float>(blob.half_width);
    const uint32_t seed = mixBits(seed_ + wrapped(1000.0 * (blob.x + 100.0 * blob.y)));
    // The border is at least one texel wide.
    const float soft = std::max(0.3F, static_cast<float>(texel_m_) / half_width);
    for (int row = box.y; row < box.y + box.height; ++row) {
      const auto dy = static_cast<float>(area_.min_y + (row + 0.5) * texel_m_ - blob.y);
      for (int column = box.x; column < box.x + box.width; ++column) {
        const auto dx = static_cast<float>(area_.min_x + (column + 0.5) * texel_m_ - blob.x);
        const float along = (dx * cosine + dy * sine) / half_length;
        const float across = (dy * cosine - dx * sine) / half_width;
        const float wobble =
            0.35F * fractalNoise(2.4F * dx / half_length, 2.4F * dy / half_length, 3, 0.6F, seed);
        const float radius = std::sqrt(along * along + across * across) + wobble;
        float change =
            static_cast<float>(blob.strength) * (1.0F - ramp(radius, 0.8F - soft, 0.8F + 0.5F * soft));
        if (blob.rim != 0.0) {
          change += static_cast<float>(blob.rim) * std::max(0.0F, 1.0F - std::abs(radius - 0.85F) / 0.1F);
        }
        image_.at<float>(row, column) *= 1.0F + change;
      }
    }
  }

  // A quarter circle from the lane (angle 0) into the bay, with streaks of the tread along it.
  void arc(double middle_x, double middle_y, double radius_m, double side, double towards, double from_rad,
           double to_rad, double strength) {
    const double step_rad = 0.5 * texel_m_ / radius_m;
    const double half_m = 0.09;
    const uint32_t seed = mixBits(seed_ + wrapped(1000.0 * (middle_x + 300.0 + radius_m)));
    for (double angle = from_rad; angle < to_rad; angle += step_rad) {
      const double end_m = radius_m * std::min(angle - from_rad, to_rad - angle);
      const auto along = static_cast<float>(radius_m * angle);
      for (double across = -half_m; across <= half_m; across += 0.5 * texel_m_) {
        const double r = radius_m + across;
        const double x = middle_x + side * r * std::sin(angle);
        const double y = middle_y - towards * r * std::cos(angle);
        const cv::Rect texel = texels(x, y, x, y);
        if (texel.empty()) {
          continue;
        }
        const float streak =
            0.6F + 0.6F * fractalNoise(along * 1.5F, static_cast<float>(across) * 30.0F, 3, 0.8F, seed);
        const float edge = 1.0F - ramp(static_cast<float>(std::abs(across)), 0.06F, 0.09F);
        // Half-texel steps in both directions visit each texel about four times.
        const float change = 0.25F * static_cast<float>(strength * std::min(1.0, end_m / 0.6)) * edge *
                             std::clamp(streak, 0.0F, 1.4F);
        image_.at<float>(texel.y, texel.x) *= 1.0F - change;
      }
    }
  }

  const GaragePlan plan_;
  const GroundRectangle area_;
  const double texel_m_;
  const uint32_t seed_;
  Random random_;
  cv::Mat image_;
};

}  // namespace

cv::Mat drawGarageStains(const GarageLayout& layout, double texel_m, uint64_t seed) {
  StainPainter painter(layout.plan, texel_m, seed);
  painter.addPatches();
  painter.addTyreMarks(layout.bays);
  painter.addStains();
  painter.addOil(layout.bays);
  painter.addSpecks();
  return painter.image();
}

}  // namespace vcharge
