#include "surround_view/car_drawing.h"

#include <algorithm>
#include <cmath>

namespace vcharge {
namespace {

// Gray levels, and opacities in 255ths.
constexpr double kBody = 70.0, kGlass = 190.0, kRim = 225.0;
constexpr double kBodyOpacity = 140.0, kGlassOpacity = 190.0, kRimOpacity = 235.0;
constexpr double kRim_m = 0.06;

/// Distance to a rectangle with rounded corners in metres, negative inside. `offset`: from its middle.
double distanceToRounded_m(const Eigen::Vector2d& offset_m, const Eigen::Vector2d& half_size_m,
                           double radius_m) {
  const Eigen::Array2d outside = offset_m.array().abs() - half_size_m.array() + radius_m;
  return outside.max(0.0).matrix().norm() + std::min(outside.maxCoeff(), 0.0) - radius_m;
}

}  // namespace

CarDrawing::CarDrawing(const ViewGrid& grid) : region_(grid.around(0.05)) {
  gray_.create(region_.size(), CV_8UC1);
  opacity_.create(region_.size(), CV_8UC1);
  const VehicleOutline& outline = grid.outline();
  const double length_m = outline.front_m - outline.rear_m;
  const Eigen::Vector2d half_size_m(0.5 * length_m, outline.half_width_m);
  for (int row = 0; row < region_.height; ++row) {
    for (int column = 0; column < region_.width; ++column) {
      Eigen::Vector2d offset_m = grid.positionOf({region_.x + column, region_.y + row});
      offset_m.x() -= 0.5 * (outline.front_m + outline.rear_m);
      // Part of the pixel inside of an edge at this distance.
      const auto inside = [&](double distance_m) {
        return std::clamp(0.5 - distance_m / grid.pixel_m(), 0.0, 1.0);
      };
      const double body_m = distanceToRounded_m(offset_m, half_size_m, 0.55 * outline.half_width_m);
      // Windscreen and rear window are trapezoids, wider towards the ends of the vehicle.
      const double along = offset_m.x() / half_size_m.x(), across = std::abs(offset_m.y()) / half_size_m.y();
      const double front_m = std::max({(along - 0.42) * half_size_m.x(), (0.14 - along) * half_size_m.x(),
                                       (across - 0.62 - 0.6 * (along - 0.14)) * half_size_m.y()});
      const double rear_m = std::max({(-along - 0.78) * half_size_m.x(), (0.6 + along) * half_size_m.x(),
                                      (across - 0.6 - 0.6 * (-along - 0.6)) * half_size_m.y()});
      const double is_body = inside(body_m), is_glass = inside(std::min(front_m, rear_m));
      const double is_rim = is_body * (1.0 - inside(body_m + kRim_m));
      const double gray = kBody + is_glass * (kGlass - kBody);
      const double opacity = kBodyOpacity + is_glass * (kGlassOpacity - kBodyOpacity);
      gray_.at<uint8_t>(row, column) = static_cast<uint8_t>(gray + is_rim * (kRim - gray));
      opacity_.at<uint8_t>(row, column) =
          static_cast<uint8_t>(is_body * (opacity + is_rim * (kRimOpacity - opacity)));
    }
  }
}

void CarDrawing::draw(cv::Mat* image) const {
  for (int row = 0; row < region_.height; ++row) {
    uint8_t* pixels = image->ptr<uint8_t>(region_.y + row) + region_.x;
    const uint8_t* gray = gray_.ptr<uint8_t>(row);
    const uint8_t* opacity = opacity_.ptr<uint8_t>(row);
    for (int column = 0; column < region_.width; ++column) {
      const int ground = pixels[column] * (255 - opacity[column]);
      pixels[column] = static_cast<uint8_t>((ground + gray[column] * opacity[column] + 127) / 255);
    }
  }
}

}  // namespace vcharge
