#include "vcharge_reconstruction/landmarks/landmark_alignment.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>
#include <Eigen/Geometry>

#include "vcharge_features/patch_alignment.h"

namespace vcharge {
namespace {

/// Largest distance of an aligned position from the observed one.
constexpr double kMaxShift_px = 2.0;

PatchAlignmentOptions patchOptions() {
  PatchAlignmentOptions options;
  options.shape_sigma = 0.2;  // surfaces have any slant
  options.min_correlation = 0.8;
  return options;
}

/// Height below which a landmark is on the ground.
constexpr double kMaxGroundHeight_m = 0.05;

struct LandmarkPatch {
  const TrackObservation* source = nullptr;
  cv::Mat image;  // part of the image around the source
  Eigen::Vector2d anchor_px = Eigen::Vector2d::Zero();
};

class LandmarkAlignment {
 public:
  LandmarkAlignment(const LandmarkAlignmentOptions& options, const KeyframeImages& images,
                    int32_t first_of_new, ReconstructionData* data)
      : options_(options),
        images_(images),
        first_of_new_(first_of_new),
        data_(*data),
        patches_(data->tracks.size()),
        seen_(data->keyframes.size() * data->rig->cameras.size()) {}

  int64_t run() {
    choosePatches();
    tbb::parallel_for(size_t{0}, seen_.size(), [&](size_t image) { cutPatches(image); });
    std::atomic<int64_t> num_aligned{0};
    tbb::parallel_for(size_t{0}, seen_.size(), [&](size_t image) { num_aligned += alignImage(image); });
    return num_aligned;
  }

 private:
  using TrackedObservation = std::pair<size_t, TrackObservation*>;  // track and its observation

  size_t imageOf(const TrackObservation& seen) const {
    return static_cast<size_t>(seen.keyframe) * data_.rig->cameras.size() + static_cast<size_t>(seen.camera);
  }

  RigidTransform mapFromCamera(const TrackObservation& seen) const {
    return cameraAt(data_.keyframes[seen.keyframe], *data_.rig, seen.camera).poseAt(seen.position_px);
  }

  const CameraModel& modelOf(const TrackObservation& seen) const {
    return data_.rig->cameras[seen.camera].model;
  }

  cv::Mat imageAt(size_t image) const {
    const size_t num_cameras = data_.rig->cameras.size();
    return images_.image(static_cast<int32_t>(image / num_cameras), image % num_cameras);
  }

  /// Chooses the observation of median range: the other scales differ least from its scale.
  void choosePatches() {
    for (size_t t = 0; t < data_.tracks.size(); ++t) {
      Track& track = data_.tracks[t];
      if (!track.position_m || track.observations.size() < 2 ||
          track.observations.back().keyframe < first_of_new_) {
        continue;
      }
      std::vector<std::pair<double, size_t>> ranges_m;
      for (size_t i = 0; i < track.observations.size(); ++i) {
        seen_[imageOf(track.observations[i])].emplace_back(t, &track.observations[i]);
        ranges_m.emplace_back((*track.position_m - mapFromCamera(track.observations[i]).translation()).norm(),
                              i);
      }
      std::sort(ranges_m.begin(), ranges_m.end());
      patches_[t].source = &track.observations[ranges_m[ranges_m.size() / 2].second];
    }
  }

  void cutPatches(size_t image_index) {
    cv::Mat image;
    for (const auto& [track, seen] : seen_[image_index]) {
      if (patches_[track].source != seen) {
        continue;
      }
      if (image.empty()) {
        image = imageAt(image_index);
      }
      if (image.empty()) {
        return;  // the image is not available
      }
      const int reach_px = patch_options_.radius_px + 4;
      const cv::Point middle(static_cast<int>(std::lround(seen->position_px.x())),
                             static_cast<int>(std::lround(seen->position_px.y())));
      const cv::Rect around =
          cv::Rect(middle.x - reach_px, middle.y - reach_px, 2 * reach_px + 1, 2 * reach_px + 1) &
          cv::Rect(cv::Point(), image.size());
      patches_[track].image = image(around).clone();
      patches_[track].anchor_px = seen->position_px - Eigen::Vector2d(around.x, around.y);
    }
  }

  int64_t alignImage(size_t image_index) {
    cv::Mat image;
    int64_t num_aligned = 0;
    for (const auto& [track, seen] : seen_[image_index]) {
      const LandmarkPatch& patch = patches_[track];
      if (patch.image.empty()) {
        continue;
      }
      if (patch.source == seen) {
        seen->sigma_px = options_.sigma_px;
        continue;
      }
      if (image.empty()) {
        image = imageAt(image_index);
      }
      const std::optional<Eigen::Matrix2d> shape =
          expectedShape(*data_.tracks[track].position_m, *patch.source, *seen);
      const auto aligned =
          shape ? alignPatch(patch.image, image, patch.anchor_px, {seen->position_px, *shape}, patch_options_)
                : std::nullopt;
      if (aligned && (aligned->position_px - seen->position_px).norm() <= kMaxShift_px) {
        seen->position_px = aligned->position_px;
        seen->sigma_px = aligned->sigma_px;
        ++num_aligned;
      } else {
        seen->sigma_px = std::max(seen->sigma_px, kImpreciseSigma_px);
      }
    }
    return num_aligned;
  }

  /// Warp of the pixels around the landmark from the source to another image, for a landmark on the ground,
  /// or else on a surface that faces the source.
  std::optional<Eigen::Matrix2d> expectedShape(const Eigen::Vector3d& point_m, const TrackObservation& source,
                                               const TrackObservation& seen) const {
    const RigidTransform map_from_source = mapFromCamera(source);
    const RigidTransform seen_from_map = mapFromCamera(seen).inverse();
    const RigidTransform& vehicle = data_.keyframes[seen.keyframe].map_from_vehicle;
    const Eigen::Vector3d up = vehicle.rotationMatrix().col(2);
    const bool is_ground = std::abs(up.dot(point_m - vehicle.translation())) < kMaxGroundHeight_m;
    const Eigen::Vector3d normal = is_ground ? up : (map_from_source.translation() - point_m).normalized();
    Eigen::Vector2d center_px;
    if (!modelOf(source).project(map_from_source.inverse() * point_m, &center_px)) {
      return std::nullopt;
    }
    const auto transfer = [&](const Eigen::Vector2d& pixel, Eigen::Vector2d* other) {
      Eigen::Vector3d ray;
      if (!modelOf(source).unproject(pixel, &ray)) {
        return false;
      }
      const Eigen::Vector3d direction = map_from_source.rotation() * ray;
      const double slope = normal.dot(direction);
      const double range_m = normal.dot(point_m - map_from_source.translation()) / slope;
      return range_m > 0.0 &&
             modelOf(seen).project(seen_from_map * (map_from_source.translation() + range_m * direction),
                                   other);
    };
    Eigen::Matrix2d shape;
    for (int axis = 0; axis < 2; ++axis) {
      Eigen::Vector2d before, after;
      if (!transfer(center_px - Eigen::Vector2d::Unit(axis), &before) ||
          !transfer(center_px + Eigen::Vector2d::Unit(axis), &after)) {
        return std::nullopt;
      }
      shape.col(axis) = 0.5 * (after - before);
    }
    return std::abs(shape.determinant()) > 1e-3 ? std::make_optional(shape) : std::nullopt;
  }

  const LandmarkAlignmentOptions& options_;
  const PatchAlignmentOptions patch_options_ = patchOptions();
  const KeyframeImages& images_;
  const int32_t first_of_new_;
  ReconstructionData& data_;
  std::vector<LandmarkPatch> patches_;                 // one per track
  std::vector<std::vector<TrackedObservation>> seen_;  // observations in each image
};

}  // namespace

int64_t alignLandmarks(const LandmarkAlignmentOptions& options, const KeyframeImages& images,
                       ReconstructionData* data, int32_t first_of_new) {
  return LandmarkAlignment(options, images, first_of_new, data).run();
}

}  // namespace vcharge
