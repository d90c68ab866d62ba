#include "surround_view/obstacle_seams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Obstacles reach this far beyond their cells: bodies overhang what stands on the ground, and cells have
// errors.
constexpr double kMargin_m = 0.2;
// Weights of a block on an obstacle, which decides, and of one that a camera does not see because of an
// obstacle, over that of one whose ground it sees.
constexpr double kFootWeight = 1000.0, kBehindWeight = 0.1;
constexpr double kKeepWeight = 0.5;  // a camera that showed all of it counts this much more

constexpr double kTwoPi = 6.283185307179586;

double directionOf(const Eigen::Vector2d& offset, int num_directions) {
  return (std::atan2(offset.y(), offset.x()) / kTwoPi + 0.5) * num_directions;
}

}  // namespace

ObstacleSeams::ObstacleSeams(const ViewGrid& grid, const CameraRig& rig, const ViewLayers& layers)
    : grid_(grid),
      blocks_(static_cast<size_t>(grid.sizeBlocks().area())),
      horizons_(rig.cameras.size()),
      cameras_(grid.sizeBlocks(), CV_8UC1, cv::Scalar(kNoCamera)),
      last_cameras_(cameras_.clone()),
      is_hidden_(cv::Mat::zeros(grid.sizeBlocks(), CV_8UC1)),
      is_foot_(cv::Mat::zeros(grid.sizeBlocks(), CV_8UC1)),
      is_behind_(cv::Mat::zeros(grid.sizeBlocks(), CV_8UC1)) {
  camera_positions_m_.assign(rig.cameras.size(),
                             Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
  std::map<std::pair<uint8_t, uint8_t>, std::vector<size_t>> pairs;
  for (int row = 0; row < cameras_.rows; ++row) {
    for (int column = 0; column < cameras_.cols; ++column) {
      const int pixel = (row * kSurroundBlock_px + kSurroundBlock_px / 2) * grid.size().width +
                        column * kSurroundBlock_px + kSurroundBlock_px / 2;
      const ViewSample& first = layers.first[static_cast<size_t>(pixel)];
      const ViewSample& second = layers.second[static_cast<size_t>(pixel)];
      Block& block = blocks_[static_cast<size_t>(row * cameras_.cols + column)];
      const double ratio = layers.sigma_ratio[static_cast<size_t>(pixel)];
      const double quality = second.camera == kNoCamera ? 1.0 : ratio * ratio / (1.0 + ratio * ratio);
      const auto see = [&](uint8_t camera, double part) {
        if (camera == kNoCamera) {
          return Sight();
        }
        const Eigen::Vector2d position_m = rig.cameras[camera].vehicle_from_camera->translation().head<2>();
        camera_positions_m_[camera] = position_m;
        const Eigen::Vector2d offset = grid.positionOfBlock(column, row) - position_m;
        const int direction =
            std::min(static_cast<int>(directionOf(offset, kNumDirections)), kNumDirections - 1);
        return Sight{camera, static_cast<uint16_t>(direction), static_cast<float>(offset.norm()),
                     static_cast<float>(part)};
      };
      block.first = see(first.camera, quality);
      block.second = see(second.camera, 1.0 - quality);
      if (second.camera != kNoCamera) {
        const auto cameras = std::minmax(first.camera, second.camera);
        pairs[{cameras.first, cameras.second}].push_back(static_cast<size_t>(row * cameras_.cols + column));
      }
    }
  }
  for (auto& [cameras, blocks] : pairs) {
    pairs_.push_back(std::move(blocks));
  }
}

void ObstacleSeams::addToHorizon(const Eigen::Vector2d& obstacle_m, double radius_m, size_t camera) {
  const Eigen::Vector2d offset = obstacle_m - camera_positions_m_[camera];
  const double distance_m = offset.norm();
  const auto begin_m = static_cast<float>(std::max(0.0, distance_m - radius_m));
  const double half_width = distance_m > radius_m ? std::asin(radius_m / distance_m) / kTwoPi * kNumDirections
                                                  : 0.5 * kNumDirections;
  const double middle = directionOf(offset, kNumDirections);
  const int first = static_cast<int>(std::floor(middle - half_width));
  const int last = std::min(static_cast<int>(std::floor(middle + half_width)), first + kNumDirections - 1);
  for (int direction = first; direction <= last; ++direction) {
    float& nearest_m = horizons_[camera][static_cast<size_t>((direction + kNumDirections) % kNumDirections)];
    nearest_m = std::min(nearest_m, begin_m);
  }
}

void ObstacleSeams::markFeet(const std::vector<Eigen::Vector2d>& obstacles_m, double radius_m) {
  is_foot_ = 0;
  const double radius_blocks = radius_m / (kSurroundBlock_px * grid_.pixel_m());
  const cv::Rect whole({0, 0}, is_foot_.size());
  for (const Eigen::Vector2d& obstacle_m : obstacles_m) {
    const Eigen::Vector2d block = (grid_.pixelOf(obstacle_m).array() + 0.5) / kSurroundBlock_px;
    const cv::Point begin(static_cast<int>(std::floor(block.x() - radius_blocks)),
                          static_cast<int>(std::floor(block.y() - radius_blocks)));
    const cv::Point end(static_cast<int>(std::ceil(block.x() + radius_blocks)),
                        static_cast<int>(std::ceil(block.y() + radius_blocks)));
    is_foot_(cv::Rect(begin, end) & whole) = 255;
  }
}

void ObstacleSeams::update(const std::vector<Eigen::Vector2d>& obstacles_m, double radius_m,
                           const std::vector<bool>& has_image) {
  std::swap(cameras_, last_cameras_);
  cameras_ = kNoCamera;
  is_hidden_ = 0;
  if (obstacles_m.empty()) {
    return;
  }
  for (size_t camera = 0; camera < horizons_.size(); ++camera) {
    horizons_[camera].fill(std::numeric_limits<float>::infinity());
    if (camera_positions_m_[camera].allFinite()) {
      for (const Eigen::Vector2d& obstacle_m : obstacles_m) {
        addToHorizon(obstacle_m, radius_m + kMargin_m, camera);
      }
    }
  }
  markFeet(obstacles_m, radius_m + kMargin_m);
  for (size_t i = 0; i < blocks_.size(); ++i) {
    is_hidden_.data[i] = isBehind(blocks_[i].first) || isBehind(blocks_[i].second) ? 255 : 0;
  }
  for (const std::vector<size_t>& pair : pairs_) {
    chooseCameras(pair, has_image);
  }
}

void ObstacleSeams::chooseCameras(const std::vector<size_t>& pair, const std::vector<bool>& has_image) {
  is_behind_ = 0;
  for (const size_t i : pair) {
    is_behind_.data[i] = is_hidden_.data[i];
  }
  const int num_components = cv::connectedComponents(is_behind_, components_, 8, CV_32S);
  struct Score {
    std::array<uint8_t, 2> cameras = {kNoCamera, kNoCamera};
    std::array<double, 2> sums = {0.0, 0.0};
    std::array<double, 2> kept = {0.0, 0.0};
    double num_blocks = 0.0;
  };
  std::vector<Score> scores(static_cast<size_t>(num_components));
  const int* components = components_.ptr<int>();
  for (const size_t i : pair) {
    if (components[i] == 0) {
      continue;
    }
    Score& score = scores[static_cast<size_t>(components[i])];
    const auto cameras = std::minmax(blocks_[i].first.camera, blocks_[i].second.camera);
    score.cameras = {cameras.first, cameras.second};
    for (const Sight& sight : {blocks_[i].first, blocks_[i].second}) {
      const size_t which = sight.camera == score.cameras[0] ? 0 : 1;
      const double weight = is_foot_.data[i] != 0 ? kFootWeight : isBehind(sight) ? kBehindWeight : 1.0;
      score.sums[which] += weight * sight.quality;
      score.kept[which] += last_cameras_.data[i] == sight.camera ? 1.0 : 0.0;
    }
    score.num_blocks += 1.0;
  }
  std::vector<uint8_t> chosen(scores.size(), kNoCamera);
  for (size_t component = 1; component < scores.size(); ++component) {
    Score& score = scores[component];
    for (const size_t which : {0, 1}) {
      score.sums[which] *=
          has_image[score.cameras[which]] ? 1.0 + kKeepWeight * score.kept[which] / score.num_blocks : 0.0;
    }
    chosen[component] = score.cameras[score.sums[0] >= score.sums[1] ? 0 : 1];
  }
  for (const size_t i : pair) {
    if (components[i] != 0) {
      cameras_.data[i] = chosen[static_cast<size_t>(components[i])];
    }
  }
}

}  // namespace vcharge
