#include "surround_view/ground_memory.h"

#include <algorithm>
#include <cmath>

namespace vcharge {
namespace {

constexpr double kMargin_m = 1.0;  // ground at this distance from the vehicle is stored
constexpr double kKeep_s = 5.0;    // a cell is not stored again within this time
constexpr int kCompareStep = 4;    // distance of cells from which the change of the brightness is found
constexpr size_t kMinCompared = 200;
constexpr float kFollow = 0.3F;  // part of a change that one frame takes over
constexpr float kMaxStep = 2.0F;
constexpr float kFraction = 256.0F;

bool isShown(uint8_t label) {
  return label != kSurroundMemory && label != kSurroundUnknown;
}

}  // namespace

GroundMemory::GroundMemory(const ViewGrid& grid) : grid_(grid), region_(grid.around(kMargin_m)) {
  const double diagonal_px = std::hypot(region_.width, region_.height) + 4.0;
  while ((1 << tile_bits_) < diagonal_px) {
    ++tile_bits_;
  }
  mask_ = (1 << tile_bits_) - 1;
  clear();
}

void GroundMemory::clear() {
  cells_.assign(static_cast<size_t>(mask_ + 1) * static_cast<size_t>(mask_ + 1), Cell());
  brightness_ = 1.0F;
}

void GroundMemory::store(Timestamp stamp, const cv::Mat& image, const cv::Mat& labels,
                         const cv::Mat& is_hidden, const RigidTransform& odom_from_vehicle) {
  const double pixel_m = grid_.pixel_m();
  const double yaw_rad = yawOfRotation(odom_from_vehicle.rotation());
  const Eigen::Vector2d origin_m = odom_from_vehicle.translation().head<2>();
  const double cos = std::cos(yaw_rad), sin = std::sin(yaw_rad);
  // The box of cells around the region's corners.
  Eigen::Array2d low_m = Eigen::Array2d::Constant(INFINITY), high_m = -low_m;
  for (const int corner : {0, 1, 2, 3}) {
    const Eigen::Vector2d pixel(corner % 2 == 0 ? region_.x : region_.x + region_.width - 1,
                                corner / 2 == 0 ? region_.y : region_.y + region_.height - 1);
    const Eigen::Vector2d position_m = grid_.positionOf(pixel);
    const Eigen::Array2d turned_m(origin_m.x() + cos * position_m.x() - sin * position_m.y(),
                                  origin_m.y() + sin * position_m.x() + cos * position_m.y());
    low_m = low_m.min(turned_m);
    high_m = high_m.max(turned_m);
  }
  const Eigen::Array2i low = (low_m / pixel_m).ceil().cast<int>(),
                       high = (high_m / pixel_m).floor().cast<int>();
  ratios_.clear();
  const int first_column = region_.x, last_column = region_.x + region_.width - 1;
  const int first_row = region_.y, last_row = region_.y + region_.height - 1;
  for (int y = low.y(); y <= high.y(); ++y) {
    for (int x = low.x(); x <= high.x(); ++x) {
      const double east_m = x * pixel_m - origin_m.x(), north_m = y * pixel_m - origin_m.y();
      const Eigen::Vector2d pixel =
          grid_.pixelOf({cos * east_m + sin * north_m, cos * north_m - sin * east_m});
      const int column = static_cast<int>(std::floor(pixel.x())),
                row = static_cast<int>(std::floor(pixel.y()));
      if (column < first_column || row < first_row || column >= last_column || row >= last_row) {
        continue;
      }
      const uint8_t* upper_labels = labels.ptr<uint8_t>(row) + column;
      const uint8_t* lower_labels = labels.ptr<uint8_t>(row + 1) + column;
      if (!isShown(upper_labels[0]) || !isShown(upper_labels[1]) || !isShown(lower_labels[0]) ||
          !isShown(lower_labels[1]) ||
          is_hidden.at<uint8_t>(row / kSurroundBlock_px, column / kSurroundBlock_px) != 0) {
        continue;
      }
      const auto right = static_cast<float>(pixel.x() - column), down = static_cast<float>(pixel.y() - row);
      const uint8_t* upper = image.ptr<uint8_t>(row) + column;
      const uint8_t* lower = image.ptr<uint8_t>(row + 1) + column;
      const float above = static_cast<float>(upper[0]) + right * static_cast<float>(upper[1] - upper[0]);
      const float below = static_cast<float>(lower[0]) + right * static_cast<float>(lower[1] - lower[0]);
      const float gray = std::max(1.0F, above + down * (below - above));
      Cell& cell = at(x, y);
      const uint16_t tile = tileOf(x, y);
      if (cell.gray != 0 && cell.tile == tile) {
        if (x % kCompareStep == 0 && y % kCompareStep == 0) {
          ratios_.push_back(gray * kFraction / (brightness_ * static_cast<float>(cell.gray)));
        }
        if (std::abs(toSeconds(stamp - cell.stamp)) < kKeep_s) {
          continue;
        }
      }
      cell.gray = static_cast<uint16_t>(std::clamp(kFraction * gray / brightness_, 1.0F, 65535.0F));
      cell.tile = tile;
      cell.stamp = stamp;
    }
  }
  if (ratios_.size() >= kMinCompared) {
    const auto middle = ratios_.begin() + static_cast<std::ptrdiff_t>(ratios_.size() / 2);
    std::nth_element(ratios_.begin(), middle, ratios_.end());
    const float step = std::pow(std::clamp(*middle, 1.0F / kMaxStep, kMaxStep), kFollow);
    brightness_ = std::clamp(brightness_ * step, 0.1F, 10.0F);
  }
}

void GroundMemory::fill(const RigidTransform& odom_from_vehicle, cv::Mat* image, cv::Mat* labels) const {
  const double pixel_m = grid_.pixel_m();
  const double yaw_rad = yawOfRotation(odom_from_vehicle.rotation());
  const Eigen::Vector2d origin_m = odom_from_vehicle.translation().head<2>();
  const double cos = std::cos(yaw_rad), sin = std::sin(yaw_rad);
  for (int row = region_.y; row < region_.y + region_.height; ++row) {
    uint8_t* label = labels->ptr<uint8_t>(row);
    for (int column = region_.x; column < region_.x + region_.width; ++column) {
      if (label[column] != kSurroundUnknown) {
        continue;
      }
      const Eigen::Vector2d position_m = grid_.positionOf({column, row});
      const double x = (origin_m.x() + cos * position_m.x() - sin * position_m.y()) / pixel_m;
      const double y = (origin_m.y() + sin * position_m.x() + cos * position_m.y()) / pixel_m;
      const int left = static_cast<int>(std::floor(x)), low = static_cast<int>(std::floor(y));
      float sum = 0.0F, weights = 0.0F;
      for (const int up : {0, 1}) {
        for (const int right : {0, 1}) {
          const Cell& cell = at(left + right, low + up);
          if (cell.gray != 0 && cell.tile == tileOf(left + right, low + up)) {
            const auto weight = static_cast<float>((right != 0 ? x - left : 1.0 - (x - left)) *
                                                   (up != 0 ? y - low : 1.0 - (y - low)));
            sum += weight * static_cast<float>(cell.gray);
            weights += weight;
          }
        }
      }
      if (weights >= 0.5F) {
        const float gray = brightness_ * sum / (weights * kFraction);
        image->at<uint8_t>(row, column) = static_cast<uint8_t>(std::min(255.0F, gray + 0.5F));
        label[column] = kSurroundMemory;
      }
    }
  }
}

}  // namespace vcharge
