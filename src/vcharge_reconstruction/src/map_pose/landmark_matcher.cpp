#include "map_pose/landmark_matcher.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <tbb/parallel_for.h>
#include <opencv2/core.hpp>

#include "vcharge_core/base/quantile.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_reconstruction/exposed_ray.h"

namespace vcharge {
namespace {

constexpr double kReferenceWidth_px = 1280.0;
/// Least search radius in the image, since features of small images are not more accurate.
constexpr double kLeastRadius_px = 3.0;
/// Search radius in an image of the reference width, also of the second search.
constexpr double kMinRadius_px = 6.0;
/// Search radius in standard deviations of the expected pose.
constexpr double kRadiusSigmas = 3.0;
/// Typical resolution of the lenses at the reference width.
constexpr double kReferencePixelsPerRadian = 450.0;
/// Keyframes before and after a recognized one whose landmarks are searched too.
constexpr int kNeighbours = 2;
/// Largest distance of the descriptors of a match over the median distance of unrelated ones: a threshold for
/// all kinds of descriptors.
constexpr double kMaxRelativeDistance = 0.55;

MatchOptions closeMatches() {
  MatchOptions options;
  options.max_ratio = 0.85;
  return options;
}

/// Keeps the nearest match of each landmark: those of different drives may find different features.
std::vector<FeatureMatch> oneOfEachLandmark(const std::vector<FeatureMatch>& matches,
                                            const std::vector<TileObservation>& observations) {
  std::vector<FeatureMatch> kept;
  std::unordered_map<int32_t, size_t> kept_of_landmark;
  for (const FeatureMatch& match : matches) {
    const auto [found, is_new] = kept_of_landmark.emplace(
        observations[static_cast<size_t>(match.first_index)].landmark().id, kept.size());
    if (is_new) {
      kept.push_back(match);
    } else if (match.distance < kept[found->second].distance) {
      kept[found->second] = match;
    }
  }
  return kept;
}

}  // namespace

void LandmarkMatches::append(const LandmarkMatches& other) {
  observations.insert(observations.end(), other.observations.begin(), other.observations.end());
  points.insert(points.end(), other.points.begin(), other.points.end());
}

LandmarkMatcher::LandmarkMatcher(std::shared_ptr<const TiledMap> map, std::shared_ptr<const CameraRig> rig,
                                 const MapLocalizerOptions& options)
    : map_(std::move(map)), rig_(std::move(rig)), options_(options), matching_(closeMatches()) {
  if (map_->unrelatedDistance() > 0.0) {
    matching_.max_distance =
        std::min(matching_.max_distance, kMaxRelativeDistance * map_->unrelatedDistance());
  }
}

cv::Mat LandmarkMatcher::descriptorsOf(const std::vector<TileObservation>& observations) const {
  cv::Mat descriptors(static_cast<int>(observations.size()), map_->descriptorColumns(),
                      map_->descriptorType());
  for (size_t i = 0; i < observations.size(); ++i) {
    observations[i].descriptor().copyTo(descriptors.row(static_cast<int>(i)));
  }
  return descriptors;
}

void LandmarkMatcher::add(const RigFeatures& features, size_t camera, const TileObservation& observation,
                          int feature, float distance, LandmarkMatches* matches) const {
  const Eigen::Vector3d ray = features.rays_in_camera[camera].col(feature);
  if (ray.isZero()) {
    return;
  }
  const cv::Point2f position_px = features.images[camera].keypoints[static_cast<size_t>(feature)].position_px;
  const MapLandmark& landmark = observation.landmark();
  PointMatch point;
  point.ray =
      rayInVehicle(rig_->cameras[camera], ray, {position_px.x, position_px.y}, features.motion.of(camera));
  point.point_m = landmark.position_m;
  point.camera = static_cast<int>(camera);
  point.quality = -distance;
  matches->points.push_back(point);
  matches->observations.push_back(
      {landmark.id, static_cast<int32_t>(camera), position_px, landmark.position_m, observation.numDrives()});
}

LandmarkMatches LandmarkMatcher::searchNear(const RigFeatures& features,
                                            const RigidTransform& map_from_vehicle, double sigma_m,
                                            double sigma_rad) const {
  const LandmarkView view(*map_, *rig_, options_, map_from_vehicle, features.motion);
  std::vector<LandmarkMatches> of_camera(rig_->cameras.size());
  tbb::parallel_for(size_t{0}, of_camera.size(), [&](size_t camera) {
    const ImageFeatures& image = features.images[camera];
    if (image.empty()) {
      return;
    }
    const ExpectedLandmarks expected = view.expectedIn(camera);
    if (expected.observations.empty()) {
      return;
    }
    std::vector<cv::Point2f> positions;
    for (const Keypoint& keypoint : image.keypoints) {
      positions.push_back(keypoint.position_px);
    }
    // Uncertainty of the direction to a landmark of median range.
    const double angle_rad = kRadiusSigmas * (sigma_rad + sigma_m / quantile(expected.ranges_m, 0.5));
    const double radius_px = std::max(
        kLeastRadius_px,
        rig_->cameras[camera].image_size_px.width / kReferenceWidth_px *
            std::clamp(kReferencePixelsPerRadian * angle_rad, kMinRadius_px, options_.max_radius_px));
    const std::vector<FeatureMatch> found =
        matchNearPixels(descriptorsOf(expected.observations), expected.positions_px, image.descriptors,
                        positions, radius_px, matching_);
    for (const FeatureMatch& match : oneOfEachLandmark(found, expected.observations)) {
      add(features, camera, expected.observations[static_cast<size_t>(match.first_index)], match.second_index,
          match.distance, &of_camera[camera]);
    }
  });
  LandmarkMatches matches;
  for (const LandmarkMatches& found : of_camera) {
    matches.append(found);
  }
  return matches;
}

std::vector<TileObservation> LandmarkMatcher::observationsAround(size_t keyframe, size_t camera,
                                                                 std::vector<KeyframeInTile>* tiles) const {
  // Takes each landmark once, from the nearest keyframe.
  std::vector<TileObservation> observations;
  std::unordered_set<int32_t> landmarks;
  const auto num_keyframes = static_cast<std::ptrdiff_t>(map_->keyframes().size());
  for (int i = 0; i <= 2 * kNeighbours; ++i) {
    const std::ptrdiff_t neighbour =
        static_cast<std::ptrdiff_t>(keyframe) + (i % 2 == 0 ? i / 2 : -(i + 1) / 2);
    if (neighbour < 0 || neighbour >= num_keyframes ||
        map_->keyframes()[static_cast<size_t>(neighbour)].session != map_->keyframes()[keyframe].session) {
      continue;
    }
    tiles->push_back(map_->tileOf(static_cast<size_t>(neighbour)));
    const SparseMap& tile = *tiles->back().tile;
    const auto [begin, end] = tile.observationsOf(tiles->back().index, camera);
    for (size_t k = begin; k < end; ++k) {
      const TileObservation observation = {&tile, k};
      if (landmarks.insert(observation.landmark().id).second) {
        observations.push_back(observation);
      }
    }
  }
  return observations;
}

LandmarkMatches LandmarkMatcher::searchAtPlace(const RigFeatures& features, const PlaceMatch& place) const {
  LandmarkMatches matches;
  for (size_t camera = 0; camera < rig_->cameras.size(); ++camera) {
    const ImageFeatures& image = features.images[camera];
    if (place.cameras[camera] < 0 || image.empty()) {
      continue;
    }
    std::vector<KeyframeInTile> tiles;
    const std::vector<TileObservation> observations = observationsAround(
        static_cast<size_t>(place.place), static_cast<size_t>(place.cameras[camera]), &tiles);
    for (const FeatureMatch& match :
         matchDescriptors(image.descriptors, descriptorsOf(observations), MatchOptions())) {
      add(features, camera, observations[static_cast<size_t>(match.second_index)], match.first_index,
          match.distance, &matches);
    }
  }
  return matches;
}

}  // namespace vcharge
