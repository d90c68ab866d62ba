#include "vcharge_reconstruction/frame_tracker.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <set>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kReferenceWidth_px = 1280.0;
/// A tracked point and a feature this close are the same point.
constexpr double kMaxAssociation_px = 1.5;
/// If alignment with its anchor moves a patch further, it has slipped or changed its appearance.
constexpr double kMaxAlignment_px = 2.0;
/// Deviation of a new anchor that could not be aligned. Without it, tracks along edges of objects pretend a
/// motion that is wrong by per cents: they slide, and all in one direction.
constexpr double kSlipSigma_px = 1.0;
/// Assumed range of points of unknown distance that are not on the ground.
constexpr double kUsualRange_m = 10.0;
constexpr double kMinRange_m = 1.0;

PatchTrackerOptions smallPatches() {
  PatchTrackerOptions options;
  options.window_px = 11;  // larger patches straddle near and far surfaces
  options.max_forward_backward_px = 0.2;
  options.max_iterations = 20;
  return options;
}

/// Expected range of the surface along a ray in the vehicle's frame.
double expectedRange(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction) {
  if (direction.z() < 0.0 && origin_m.z() > 0.0) {
    return std::clamp(-origin_m.z() / direction.z(), kMinRange_m, kUsualRange_m);
  }
  return kUsualRange_m;
}

/// Index of a new track without observations.
int32_t addTrack(ReconstructionData* data) {
  data->tracks.emplace_back();
  return static_cast<int32_t>(data->tracks.size()) - 1;
}

/// A grid of cells for finding the nearest point.
class OccupiedCells {
 public:
  OccupiedCells(cv::Size size, double spacing_px)
      : cell_px_(spacing_px),
        columns_(static_cast<int>(size.width / spacing_px) + 1),
        rows_(static_cast<int>(size.height / spacing_px) + 1),
        points_(static_cast<size_t>(columns_) * rows_) {}

  void add(cv::Point2f point, int index) {
    points_[cell(row(point), column(point))].push_back({point, index});
  }

  /// Index of the nearest point within the spacing, or -1.
  int nearest(cv::Point2f point, double* distance_px) const {
    int best = -1;
    double best_squared = cell_px_ * cell_px_;
    for (int y = std::max(0, row(point) - 1); y <= std::min(rows_ - 1, row(point) + 1); ++y) {
      for (int x = std::max(0, column(point) - 1); x <= std::min(columns_ - 1, column(point) + 1); ++x) {
        for (const auto& [other, index] : points_[cell(y, x)]) {
          const cv::Point2f difference = other - point;
          const double squared = difference.dot(difference);
          if (squared < best_squared) {
            best_squared = squared;
            best = index;
          }
        }
      }
    }
    *distance_px = std::sqrt(best_squared);
    return best;
  }

 private:
  int column(cv::Point2f point) const {
    return std::clamp(static_cast<int>(point.x / cell_px_), 0, columns_ - 1);
  }
  int row(cv::Point2f point) const { return std::clamp(static_cast<int>(point.y / cell_px_), 0, rows_ - 1); }
  size_t cell(int y, int x) const { return static_cast<size_t>(y) * columns_ + x; }

  const double cell_px_;
  const int columns_, rows_;
  std::vector<std::vector<std::pair<cv::Point2f, int>>> points_;
};

}  // namespace

void LiveTrack::begin(int32_t keyframe) {
  track = -1;
  keyframe_px = anchor_px = position_px;
  anchor_keyframe = keyframe;
  drift_variance_px2 = alignment_sigma_px = 0.0;
  anchor_shape.setIdentity();
  shape.setIdentity();
}

void LiveTrack::moveAnchor(int32_t keyframe, cv::Point2f there_px, double sigma_px) {
  drift_variance_px2 += sigma_px * sigma_px;
  anchor_keyframe = keyframe;
  anchor_px = there_px;
  alignment_sigma_px = 0.0;
  anchor_shape = shape * anchor_shape;
  shape.setIdentity();
}

CameraTracker::CameraTracker(const RigCamera& camera, const FrameTrackerOptions& options)
    : camera_(camera),
      options_(options),
      patch_tracker_(smallPatches()),
      mask_(makeFeatureMask(camera)),
      spacing_px_(std::max(4.0, options.min_spacing_px * camera.image_size_px.width / kReferenceWidth_px)) {}

double CameraTracker::exposedAt(const LiveTrack& track, const ImageMotion& motion) const {
  return motion.offset_s + camera_.exposedAt({track.position_px.x, track.position_px.y});
}

RayMatch CameraTracker::matchOf(const LiveTrack& previous, const ImageMotion& previous_motion,
                                const LiveTrack& current, const ImageMotion& motion) const {
  RayMatch match;
  const RigidTransform vehicle_from_camera = camera_.vehicle_from_camera.value_or(RigidTransform());
  match.previous = {vehicle_from_camera.translation(),
                    vehicle_from_camera.rotation() * previous.ray_in_camera};
  match.current = {vehicle_from_camera.translation(), vehicle_from_camera.rotation() * current.ray_in_camera};
  const double later_s = exposedAt(current, motion) - exposedAt(previous, previous_motion);
  if (later_s != 0.0) {
    match.current.direction = motion.rates.motionAfter(later_s).rotation() * match.current.direction;
  }
  return match;
}

cv::Point2f CameraTracker::predict(const LiveTrack& track,
                                   const RigidTransform& current_from_previous) const {
  if (!camera_.vehicle_from_camera) {
    return track.position_px + track.last_step_px;
  }
  const RigidTransform& vehicle_from_camera = *camera_.vehicle_from_camera;
  const Eigen::Vector3d direction = vehicle_from_camera.rotation() * track.ray_in_camera;
  const Eigen::Vector3d point = vehicle_from_camera.translation() +
                                expectedRange(vehicle_from_camera.translation(), direction) * direction;
  Eigen::Vector2d pixel;
  if (!camera_.model.project(vehicle_from_camera.inverse() * (current_from_previous * point), &pixel)) {
    return track.position_px;
  }
  return cv::Point2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
}

void CameraTracker::track(const Image& image, const RigidTransform& previous_from_current,
                          const ImageMotion& motion, int camera_index, std::vector<RayMatch>* matches) {
  const ImageMotion previous_motion = motion_;
  image_ = image;
  motion_ = motion;
  if (image.pixels.empty()) {
    tracks_.clear();
    anchors_.clear();
    pyramid_ = ImagePyramid();
    return;
  }
  ImagePyramid current = patch_tracker_.buildPyramid(image.pixels);
  std::vector<LiveTrack> kept;
  if (!tracks_.empty()) {
    const RigidTransform current_from_previous = previous_from_current.inverse();
    std::vector<cv::Point2f> points, predictions;
    for (const LiveTrack& track : tracks_) {
      points.push_back(track.position_px);
      predictions.push_back(predict(track, current_from_previous));
    }
    const std::vector<TrackedPoint> tracked =
        patch_tracker_.track(pyramid_, current, points, mask_, predictions);
    for (size_t i = 0; i < tracks_.size(); ++i) {
      LiveTrack next = tracks_[i];
      next.position_px = tracked[i].position_px;
      next.last_step_px = next.position_px - tracks_[i].position_px;
      if (tracked[i].status != TrackStatus::kTracked ||
          !camera_.model.unproject(Eigen::Vector2d(next.position_px.x, next.position_px.y),
                                   &next.ray_in_camera)) {
        continue;
      }
      RayMatch match = matchOf(tracks_[i], previous_motion, next, motion);
      match.previous_camera = match.current_camera = camera_index;
      matches->push_back(match);
      kept.push_back(next);
    }
  }
  tracks_ = std::move(kept);
  pyramid_ = std::move(current);
}

void CameraTracker::keep(const std::vector<bool>& is_good) {
  check(is_good.size() == tracks_.size(), "CameraTracker::keep: expected an entry per match");
  size_t kept = 0;
  for (size_t i = 0; i < tracks_.size(); ++i) {
    if (is_good[i]) {
      tracks_[kept++] = tracks_[i];
    }
  }
  tracks_.resize(kept);
}

bool CameraTracker::isMasked(const Eigen::Vector2d& position_px) const {
  return !mask_.empty() && mask_.at<uint8_t>(static_cast<int>(std::lround(position_px.y())),
                                             static_cast<int>(std::lround(position_px.x()))) == 0;
}

bool CameraTracker::align(LiveTrack* track) const {
  const Eigen::Vector2d position_px(track->position_px.x, track->position_px.y);
  const std::optional<AlignedPatch> aligned = alignPatch(
      anchors_.at(track->anchor_keyframe).pixels, image_.pixels, {track->anchor_px.x, track->anchor_px.y},
      {position_px, track->shape}, PatchAlignmentOptions());
  if (!aligned || (aligned->position_px - position_px).norm() > kMaxAlignment_px ||
      isMasked(aligned->position_px) ||
      !camera_.model.unproject(aligned->position_px, &track->ray_in_camera)) {
    return false;
  }
  track->position_px =
      cv::Point2f(static_cast<float>(aligned->position_px.x()), static_cast<float>(aligned->position_px.y()));
  track->shape = aligned->shape;
  track->alignment_sigma_px = aligned->sigma_px;
  return true;
}

bool CameraTracker::alignWithLastKeyframe(LiveTrack* track) const {
  const int32_t last_keyframe = anchors_.rbegin()->first;
  if (track->anchor_keyframe == last_keyframe) {
    return false;
  }
  LiveTrack renewed = *track;
  renewed.moveAnchor(last_keyframe, track->keyframe_px, track->alignment_sigma_px);
  if (!align(&renewed)) {
    return false;
  }
  *track = renewed;
  return true;
}

void CameraTracker::alignWithAnchors(int32_t keyframe) {
  for (LiveTrack& track : tracks_) {
    if (!align(&track) && !alignWithLastKeyframe(&track)) {
      track.moveAnchor(keyframe, track.position_px, kSlipSigma_px);
    }
    // A point on a number plate that recedes would become the car, and then the row of cars.
    if (!isSamePatch(track.shape * track.anchor_shape)) {
      track.begin(keyframe);
    }
  }
}

void CameraTracker::readKeyframe(int32_t keyframe, const FeatureExtractor& extractor, KeyframeImage* out) {
  if (image_.pixels.empty()) {
    return;
  }
  alignWithAnchors(keyframe);
  out->features = extractor.extract(image_.pixels, mask_);
  const size_t num_features = out->features.size();
  out->track_of_feature.assign(num_features, -1);
  out->rays_in_camera.resize(3, static_cast<Eigen::Index>(num_features));
  for (size_t i = 0; i < num_features; ++i) {
    const cv::Point2f position = out->features.keypoints[i].position_px;
    Eigen::Vector3d ray = Eigen::Vector3d::Zero();
    camera_.model.unproject(Eigen::Vector2d(position.x, position.y), &ray);
    out->rays_in_camera.col(static_cast<Eigen::Index>(i)) = ray;
  }
}

void CameraTracker::addKeyframe(int32_t keyframe, int32_t camera_index, ReconstructionData* data) {
  KeyframeImage& out = data->keyframes[keyframe].images[camera_index];
  if (image_.pixels.empty()) {
    return;
  }
  OccupiedCells cells(camera_.image_size_px, spacing_px_);
  std::vector<double> best_distance_px(tracks_.size(), kMaxAssociation_px);
  std::vector<int> feature_of_track(tracks_.size(), -1);
  for (size_t i = 0; i < tracks_.size(); ++i) {
    cells.add(tracks_[i].position_px, static_cast<int>(i));
  }
  std::vector<size_t> free_features;
  for (size_t i = 0; i < out.features.size(); ++i) {
    const cv::Point2f position = out.features.keypoints[i].position_px;
    double distance_px = 0.0;
    const int track = cells.nearest(position, &distance_px);
    if (track < 0) {
      free_features.push_back(i);
    } else if (distance_px <= best_distance_px[track]) {
      best_distance_px[track] = distance_px;
      feature_of_track[track] = static_cast<int>(i);
    }
  }
  for (size_t i = 0; i < tracks_.size(); ++i) {
    LiveTrack& track = tracks_[i];
    track.keyframe_px = track.position_px;
    if (track.track < 0) {
      track.track = addTrack(data);
    }
    if (feature_of_track[i] >= 0) {
      out.track_of_feature[feature_of_track[i]] = track.track;
    }
    const double sigma_px =
        std::hypot(options_.tracking_sigma_px, track.alignment_sigma_px, std::sqrt(track.drift_variance_px2));
    data->tracks[track.track].observations.push_back(
        {keyframe, camera_index, feature_of_track[i],
         Eigen::Vector2d(track.position_px.x, track.position_px.y), sigma_px});
  }
  // Sorts the most distinct features first.
  std::stable_sort(free_features.begin(), free_features.end(), [&](size_t a, size_t b) {
    return out.features.keypoints[a].response > out.features.keypoints[b].response;
  });
  const auto max_tracks = static_cast<size_t>(options_.max_tracks_per_camera);
  for (const size_t feature : free_features) {
    if (tracks_.size() >= max_tracks) {
      break;
    }
    const cv::Point2f position = out.features.keypoints[feature].position_px;
    double distance_px = 0.0;
    if (cells.nearest(position, &distance_px) >= 0) {
      continue;  // near a track that began at this keyframe
    }
    LiveTrack track;
    track.position_px = position;
    track.ray_in_camera = out.rays_in_camera.col(static_cast<Eigen::Index>(feature));
    track.begin(keyframe);
    track.track = addTrack(data);
    data->tracks[track.track].observations.push_back({keyframe, camera_index, static_cast<int32_t>(feature),
                                                      Eigen::Vector2d(position.x, position.y),
                                                      options_.tracking_sigma_px});
    out.track_of_feature[feature] = track.track;
    cells.add(position, static_cast<int>(tracks_.size()));
    tracks_.push_back(track);
  }
  anchors_.emplace(keyframe, image_);
  std::set<int32_t> used = {keyframe};
  for (const LiveTrack& track : tracks_) {
    used.insert(track.anchor_keyframe);
  }
  for (auto anchor = anchors_.begin(); anchor != anchors_.end();) {
    anchor = used.count(anchor->first) > 0 ? std::next(anchor) : anchors_.erase(anchor);
  }
}

}  // namespace vcharge
