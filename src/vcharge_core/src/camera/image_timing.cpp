#include "vcharge_core/camera/image_timing.h"

#include <array>

namespace vcharge {

ImageTiming ImageTiming::normalized() const {
  constexpr std::array<ReadoutDirection, 4> kOpposite = {ReadoutDirection::kUp, ReadoutDirection::kDown,
                                                         ReadoutDirection::kLeft, ReadoutDirection::kRight};
  return readout_s >= 0.0
             ? *this
             : ImageTiming{-readout_s, kOpposite[static_cast<size_t>(readout_direction)], clock_offset_s};
}

double ImageTiming::lineAt(const Eigen::Vector2d& position_px, cv::Size image_size_px) const {
  // Pixel centres have whole coordinates: the borders lie half a pixel outside.
  const double down = (position_px.y() + 0.5) / image_size_px.height - 0.5;
  const double right = (position_px.x() + 0.5) / image_size_px.width - 0.5;
  switch (readout_direction) {
    case ReadoutDirection::kUp:
      return -down;
    case ReadoutDirection::kRight:
      return right;
    case ReadoutDirection::kLeft:
      return -right;
    case ReadoutDirection::kDown:
      break;
  }
  return down;
}

}  // namespace vcharge
