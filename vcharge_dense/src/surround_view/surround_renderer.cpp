#include "surround_view/surround_renderer.h"

#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "kernels/parallel_rows.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int kCompareStep_px = 4;
constexpr float kMaxSigmaRatio = 3.0F;  // exposures are compared where no camera sees much better
constexpr uint8_t kUnknownGray = 36, kUnknownStripe = 56;
constexpr int kStripe_px = 12;

constexpr double kSampleUnit = 65536.0;

/// Gray level of a sample in parts of kSampleUnit.
inline uint32_t sample(const uint8_t* pixels, int stride, const PyramidPosition& position) {
  const uint8_t* upper = pixels + position.offset;
  const uint8_t* lower = upper + stride;
  const uint32_t right = position.right, down = position.down;
  return (upper[0] * (256 - right) + upper[1] * right) * (256 - down) +
         (lower[0] * (256 - right) + lower[1] * right) * down;
}

ViewLayers makeLayers(const ViewGrid& grid, const CameraRig& rig, const std::vector<bool>& is_used) {
  check(is_used.size() == rig.cameras.size(), "SurroundRenderer: expected one value per camera");
  check(rig.cameras.size() < kSurroundBlend, "SurroundRenderer: too many cameras");
  std::vector<GroundProjection> projections(rig.cameras.size());
  for (size_t camera = 0; camera < projections.size(); ++camera) {
    if (!is_used[camera]) {
      continue;
    }
    if (!rig.cameras[camera].vehicle_from_camera) {
      throw InputError("rig: cameras." + rig.cameras[camera].name + ": expected vehicle_from_camera");
    }
    projections[camera] = projectView(grid, rig, camera);
  }
  ViewLayers layers = weightCameras(grid, projections);
  for (const ViewSample& pixel : layers.first) {
    if (pixel.camera != kNoCamera) {
      return layers;
    }
  }
  throw InputError("rig: expected a camera that sees the ground within reach_m of the vehicle");
}

}  // namespace

SurroundRenderer::SurroundRenderer(const CameraRig& rig, const SurroundViewOptions& options,
                                   const std::vector<bool>& is_used)
    : grid_((options.validate(), options)),
      layers_(makeLayers(grid_, rig, is_used)),
      seams_(grid_, rig, layers_),
      exposure_(rig.cameras.size()),
      memory_(grid_),
      car_(grid_),
      scales_(rig.cameras.size()),
      image_(grid_.size(), CV_8UC1),
      labels_(grid_.size(), CV_8UC1),
      background_(grid_.size(), CV_8UC1) {
  for (const RigCamera& camera : rig.cameras) {
    pyramids_.emplace_back(camera.image_size_px);
  }
  const int columns = grid_.size().width;
  for (int row = kCompareStep_px / 2; row < grid_.size().height; row += kCompareStep_px) {
    for (int column = kCompareStep_px / 2; column < columns; column += kCompareStep_px) {
      const auto i = static_cast<size_t>(row * columns + column);
      if (layers_.second[i].camera != kNoCamera && layers_.sigma_ratio[i] < kMaxSigmaRatio &&
          layers_.sigma_ratio[i] > 1.0F / kMaxSigmaRatio) {
        compared_pixels_.push_back(row * columns + column);
      }
    }
  }
  for (int row = 0; row < background_.rows; ++row) {
    for (int column = 0; column < background_.cols; ++column) {
      background_.at<uint8_t>(row, column) =
          (row + column) / kStripe_px % 2 == 0 ? kUnknownGray : kUnknownStripe;
    }
  }
}

void SurroundRenderer::clearMemory() {
  memory_.clear();
  obstacles_.reset();
}

void SurroundRenderer::placeObstacles(const ImageFrame& frame) {
  obstacle_points_m_.clear();
  double radius_m = 0.0;
  if (obstacles_ && frame.odom_from_vehicle) {
    const RigidTransform vehicle_from_odom = frame.odom_from_vehicle->inverse();
    const Eigen::Matrix2d rotation = vehicle_from_odom.rotationMatrix().topLeftCorner<2, 2>();
    const Eigen::Vector2d translation_m = vehicle_from_odom.translation().head<2>();
    const double cell_m = obstacles_->cell_size_m;
    radius_m = cell_m * std::sqrt(0.5);
    for (int row = 0; row < obstacles_->state.rows; ++row) {
      const int8_t* states = obstacles_->state.ptr<int8_t>(row);
      for (int column = 0; column < obstacles_->state.cols; ++column) {
        if (states[column] != kCellOccupied) {
          continue;
        }
        const Eigen::Vector2d in_odom(obstacles_->origin_m.x() + (column + 0.5) * cell_m,
                                      obstacles_->origin_m.y() + (row + 0.5) * cell_m);
        const Eigen::Vector2d in_vehicle = rotation * in_odom + translation_m;
        const Eigen::Vector2d pixel = grid_.pixelOf(in_vehicle);
        if (pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < grid_.size().width &&
            pixel.y() < grid_.size().height && grid_.distanceToVehicle_m(in_vehicle) > 0.0) {
          obstacle_points_m_.push_back(in_vehicle);
        }
      }
    }
  }
  seams_.update(obstacle_points_m_, radius_m, frame.has_image);
}

void SurroundRenderer::balanceExposure(const std::vector<bool>& has_image) {
  gray_pairs_.clear();
  const auto columns = static_cast<size_t>(grid_.size().width);
  for (const int pixel : compared_pixels_) {
    const auto i = static_cast<size_t>(pixel);
    const ViewSample& first = layers_.first[i];
    const ViewSample& second = layers_.second[i];
    const auto row = static_cast<int>(i / columns), column = static_cast<int>(i % columns);
    if (has_image[first.camera] && has_image[second.camera] &&
        seams_.isHidden().at<uint8_t>(row / kSurroundBlock_px, column / kSurroundBlock_px) == 0) {
      const auto gray = [&](const ViewSample& one) {
        const ImagePyramid& pyramid = pyramids_[one.camera];
        return static_cast<uint8_t>(sample(pyramid.pixels(), pyramid.stride(), one.position) >> 16);
      };
      gray_pairs_.push_back(
          {first.camera, second.camera, gray(first), gray(second), first.angle, second.angle});
    }
  }
  exposure_.update(gray_pairs_);
}

void SurroundRenderer::setScales() {
  for (size_t angle = 0; angle <= kAngleSteps; ++angle) {
    const double brightening = exposure_.brightening(static_cast<uint8_t>(angle));
    for (size_t camera = 0; camera < scales_.size(); ++camera) {
      scales_[camera][angle] = static_cast<float>(exposure_.gains()[camera] * brightening / kSampleUnit);
    }
  }
}

void SurroundRenderer::composeRows(int begin, int end, const std::vector<bool>& has_image) {
  struct Source {
    const uint8_t* pixels;
    int stride;
    const float* scales;
  };
  std::vector<Source> sources;
  for (size_t camera = 0; camera < pyramids_.size(); ++camera) {
    const ImagePyramid& pyramid = pyramids_[camera];
    sources.push_back(
        {has_image[camera] ? pyramid.pixels() : nullptr, pyramid.stride(), scales_[camera].data()});
  }
  const auto grayOf = [&](const ViewSample& one) {
    const Source& source = sources[one.camera];
    return static_cast<float>(sample(source.pixels, source.stride, one.position)) * source.scales[one.angle];
  };
  for (int row = begin; row < end; ++row) {
    uint8_t* image = image_.ptr<uint8_t>(row);
    uint8_t* labels = labels_.ptr<uint8_t>(row);
    const uint8_t* owners = seams_.cameras().ptr<uint8_t>(row / kSurroundBlock_px);
    const ViewSample* firsts = &layers_.first[static_cast<size_t>(row) * image_.cols];
    const ViewSample* seconds = &layers_.second[static_cast<size_t>(row) * image_.cols];
    for (int column = 0; column < image_.cols; ++column) {
      const ViewSample& first = firsts[column];
      const ViewSample& second = seconds[column];
      const bool has_first = first.camera != kNoCamera && sources[first.camera].pixels != nullptr;
      const bool has_second = second.camera != kNoCamera && sources[second.camera].pixels != nullptr;
      if (!has_first && !has_second) {
        image[column] = background_.at<uint8_t>(row, column);
        labels[column] = kSurroundUnknown;
        continue;
      }
      int weight = first.weight;
      const uint8_t owner = owners[column / kSurroundBlock_px];
      if (owner != kNoCamera) {
        weight = owner == first.camera ? 255 : owner == second.camera ? 0 : weight;
      }
      weight = has_first ? has_second ? weight : 255 : 0;
      float gray = 0.0F;
      if (weight == 255) {
        gray = grayOf(first);
        labels[column] = first.camera;
      } else if (weight == 0) {
        gray = grayOf(second);
        labels[column] = second.camera;
      } else {
        const float part = static_cast<float>(weight) / 255.0F, shown = grayOf(first);
        const float other = grayOf(second);
        gray = other + part * (shown - other);
        labels[column] = kSurroundBlend;
      }
      image[column] = static_cast<uint8_t>(std::min(255.0F, gray + 0.5F));
    }
  }
}

void SurroundRenderer::render(const ImageFrame& frame) {
  check(frame.has_image.size() == pyramids_.size(), "SurroundRenderer::render: expected the rig's cameras");
  tbb::parallel_for(size_t{0}, pyramids_.size(), [&](size_t camera) {
    if (frame.has_image[camera]) {
      pyramids_[camera].set(frame.images[camera].pixels);
    }
  });
  placeObstacles(frame);
  balanceExposure(frame.has_image);
  setScales();
  forEachBand(grid_.size().height, [&](int begin, int end) { composeRows(begin, end, frame.has_image); });
  if (frame.odom_from_vehicle) {
    memory_.store(frame.stamp, image_, labels_, seams_.isHidden(), *frame.odom_from_vehicle);
    memory_.fill(*frame.odom_from_vehicle, &image_, &labels_);
  }
  car_.draw(&image_);
}

}  // namespace vcharge
