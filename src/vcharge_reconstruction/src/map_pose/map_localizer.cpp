#include "vcharge_reconstruction/map_localizer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <tbb/parallel_for.h>
#include <yaml-cpp/yaml.h>

#include "map_pose/landmark_matcher.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/camera/pixel_angle.h"
#include "vcharge_geometry/robust/pose_estimation.h"

namespace vcharge {
namespace {

// Standard deviations of the pose of a recognized place, around which the guided search begins.
constexpr double kPlaceSigma_m = 0.2;
constexpr double kPlaceSigma_rad = 0.02;
/// Places requested per candidate, since neighbouring keyframes are similar.
constexpr int kPlacesPerCandidate = 10;
/// A candidate closer than both to a better one is left out.
constexpr double kPlaceSpacing_m = 2.5;
constexpr double kPlaceSpacing_rad = 0.6;
/// Largest error of a match with a recognized place, whose landmarks were seen from another position.
constexpr double kPlaceMaxError_rad = 0.012;
/// Poses further apart belong to different places.
constexpr double kOtherPlace_m = 1.0;
constexpr double kOtherHeading_rad = 0.1;
/// Features of a coarse camera are not more accurate than this.
constexpr double kMinError_px = 0.8;

RobustOptions robustOptions() {
  RobustOptions options;
  options.max_error_rad = 0.004;
  options.max_iterations = 500;
  options.min_inliers = 12;
  return options;
}

FeatureExtractorOptions extractorOptionsOf(const TiledMap& map) {
  FeatureExtractorOptions options;
  try {
    readFields(YAML::Load(map.featureOptions()), "map: feature_options", &options);
  } catch (const YAML::Exception& error) {
    throw InputError(std::string("map: feature_options: expected YAML: ") + error.what());
  }
  return options;
}

}  // namespace

MapLocalizer::MapLocalizer(std::shared_ptr<const TiledMap> map, std::shared_ptr<const CameraRig> rig,
                           const MapLocalizerOptions& options)
    : map_(std::move(map)), rig_(std::move(rig)), options_(options), robust_(robustOptions()) {
  options_.validate();
  check(map_ != nullptr && rig_ != nullptr, "MapLocalizer: expected a map and a rig");
  if (!rig_->hasExtrinsics()) {
    throw InputError("rig: expected vehicle_from_camera of every camera, which extrinsic calibration gives");
  }
  extractor_ = makeFeatureExtractor(extractorOptionsOf(*map_));
  if (map_->descriptorType() != extractor_->descriptorType() ||
      map_->descriptorColumns() != extractor_->descriptorColumns()) {
    throw InputError("map: its descriptors are not those of its feature_options");
  }
  masks_.resize(rig_->cameras.size());
  tbb::parallel_for(size_t{0}, masks_.size(),
                    [&](size_t i) { masks_[i] = makeFeatureMask(rig_->cameras[i]); });
  for (const RigCamera& camera : rig_->cameras) {
    robust_.max_error_rad = std::max(robust_.max_error_rad, kMinError_px * radiansPerPixel(camera));
  }
  matcher_ = std::make_unique<LandmarkMatcher>(map_, rig_, options_);
}

MapLocalizer::~MapLocalizer() = default;

RigFeatures MapLocalizer::extract(const std::vector<Image>& images, const FrameMotion& motion) const {
  check(images.size() == rig_->cameras.size(), "MapLocalizer::extract: expected an image per camera");
  RigFeatures features;
  features.images.resize(images.size());
  features.rays_in_camera.resize(images.size());
  features.motion = motion;
  tbb::parallel_for(size_t{0}, images.size(), [&](size_t i) {
    if (images[i].pixels.empty()) {
      return;
    }
    features.images[i] = extractor_->extract(images[i].pixels, masks_[i]);
    const std::vector<Keypoint>& keypoints = features.images[i].keypoints;
    features.rays_in_camera[i].setZero(3, static_cast<Eigen::Index>(keypoints.size()));
    for (size_t k = 0; k < keypoints.size(); ++k) {
      Eigen::Vector3d ray;
      if (rig_->cameras[i].model.unproject(
              Eigen::Vector2d(keypoints[k].position_px.x, keypoints[k].position_px.y), &ray)) {
        features.rays_in_camera[i].col(static_cast<Eigen::Index>(k)) = ray;
      }
    }
  });
  return features;
}

PoseFix MapLocalizer::fixWithoutPose(const LandmarkMatches& matches) const {
  PoseFix fix;
  fix.num_matches = static_cast<int>(matches.points.size());
  fix.inliers_of_camera.assign(rig_->cameras.size(), 0);
  fix.matches_of_camera.assign(rig_->cameras.size(), 0);
  for (const LandmarkObservation& observation : matches.observations) {
    ++fix.matches_of_camera[observation.camera];
  }
  return fix;
}

PoseFix MapLocalizer::estimate(const LandmarkMatches& matches, int min_inliers,
                               double min_inlier_ratio) const {
  PoseFix fix = fixWithoutPose(matches);
  if (fix.num_matches < min_inliers) {
    return fix;
  }
  const PoseEstimate pose = estimateAbsolutePose(matches.points, robust_);
  fix.status = LocalizationStatus::kNoConsensus;
  if (pose.status != EstimationStatus::kOk) {
    return fix;
  }
  double sum_ratios = 0.0;
  for (const int i : pose.inliers) {
    fix.inliers.push_back(matches.observations[i]);
    sum_ratios += 1.0 / matches.observations[i].num_drives;
    ++fix.inliers_of_camera[matches.observations[i].camera];
  }
  fix.map_variance_ratio = sum_ratios / fix.numInliers();
  fix.map_from_vehicle = pose.map_from_rig;
  fix.covariance = pose.covariance;
  if (fix.numInliers() >= min_inliers && fix.numInliers() >= min_inlier_ratio * fix.num_matches &&
      fix.covariance.topLeftCorner<3, 3>().trace() <= options_.max_sigma_m * options_.max_sigma_m &&
      fix.covariance.bottomRightCorner<3, 3>().trace() <= options_.max_sigma_rad * options_.max_sigma_rad) {
    fix.status = LocalizationStatus::kLocalized;
  }
  return fix;
}

PoseFix MapLocalizer::localizeNear(const RigFeatures& features, const PosePrior& prior) const {
  const double sigma_m = std::sqrt(prior.covariance.topLeftCorner<3, 3>().diagonal().maxCoeff());
  const double sigma_rad = std::sqrt(prior.covariance.bottomRightCorner<3, 3>().diagonal().maxCoeff());
  const PoseFix first = estimate(matcher_->searchNear(features, prior.map_from_vehicle, sigma_m, sigma_rad),
                                 robust_.min_inliers, 0.0);
  return first.inliers.empty() ? first : refine(features, first, options_.min_inliers);
}

PoseFix MapLocalizer::refine(const RigFeatures& features, const PoseFix& fix, int min_inliers) const {
  return estimate(matcher_->searchNear(features, fix.map_from_vehicle, 0.0, 0.0), min_inliers,
                  options_.min_inlier_ratio);
}

int MapLocalizer::minInliersWithoutPrior(const RigFeatures& features) const {
  const auto num_cameras =
      static_cast<int>(std::count_if(features.images.begin(), features.images.end(),
                                     [](const ImageFeatures& image) { return !image.empty(); }));
  return options_.minInliersWithoutPrior(num_cameras);
}

PoseFix MapLocalizer::localizeAtPlace(const RigFeatures& features, const PlaceMatch& place) const {
  const LandmarkMatches matches = matcher_->searchAtPlace(features, place);
  // Few of these are right. If the vehicle stands on the ground, two matches determine the pose.
  const RigidTransform& map_from_keyframe =
      map_->keyframes()[static_cast<size_t>(place.place)].map_from_vehicle;
  const Eigen::Quaterniond upright_from_vehicle =
      rotationFromYawPitchRoll(-yawOfRotation(map_from_keyframe.rotation()), 0.0, 0.0) *
      map_from_keyframe.rotation();
  RobustOptions coarse = robust_;
  coarse.max_error_rad = std::max(coarse.max_error_rad, kPlaceMaxError_rad);
  PoseEstimate pose;
  if (options_.stands_upright) {
    pose = estimateUprightPose(matches.points, upright_from_vehicle, coarse);
  }
  if (pose.status != EstimationStatus::kOk) {
    pose = estimateAbsolutePose(matches.points, coarse);
  }
  if (pose.status != EstimationStatus::kOk) {
    return fixWithoutPose(matches);
  }
  // Verification: few wrong matches of the wide search fit a pose by chance.
  const PoseFix fix =
      estimate(matcher_->searchNear(features, pose.map_from_rig, kPlaceSigma_m, kPlaceSigma_rad),
               options_.min_inliers_without_prior, 0.0);
  if (fix.status != LocalizationStatus::kLocalized) {
    return fix;
  }
  return refine(features, fix, minInliersWithoutPrior(features));
}

bool MapLocalizer::isOtherPlace(const RigidTransform& a, const RigidTransform& b) {
  const RigidTransform between = a.inverse() * b;
  return between.translation().norm() > kOtherPlace_m ||
         angleOfRotation(between.rotation()) > kOtherHeading_rad;
}

std::vector<PlaceMatch> MapLocalizer::recognizePlaces(const RigFeatures& features) const {
  std::vector<cv::Mat> descriptors;
  for (const ImageFeatures& image : features.images) {
    descriptors.push_back(image.descriptors);
  }
  // Neighbouring keyframes are similar, so only one of them is kept, to leave room for other places.
  std::vector<PlaceMatch> places;
  for (const PlaceMatch& match :
       map_->places().query(descriptors, kPlacesPerCandidate * options_.max_places)) {
    const RigidTransform& pose = map_->keyframes()[static_cast<size_t>(match.place)].map_from_vehicle;
    const bool is_new = std::none_of(places.begin(), places.end(), [&](const PlaceMatch& other) {
      const RigidTransform between =
          pose.inverse() * map_->keyframes()[static_cast<size_t>(other.place)].map_from_vehicle;
      return between.translation().norm() < kPlaceSpacing_m &&
             angleOfRotation(between.rotation()) < kPlaceSpacing_rad;
    });
    if (is_new) {
      places.push_back(match);
    }
    if (static_cast<int>(places.size()) == options_.max_places) {
      break;
    }
  }
  return places;
}

std::vector<PoseFix> MapLocalizer::localizeEverywhere(const RigFeatures& features) const {
  const std::vector<PlaceMatch> places = recognizePlaces(features);
  std::vector<PoseFix> fixes(places.size());
  tbb::parallel_for(size_t{0}, places.size(),
                    [&](size_t i) { fixes[i] = localizeAtPlace(features, places[i]); });
  const auto rank = [](const PoseFix& fix) {
    return std::make_pair(fix.status == LocalizationStatus::kLocalized, fix.numInliers());
  };
  std::stable_sort(fixes.begin(), fixes.end(),
                   [&](const PoseFix& a, const PoseFix& b) { return rank(a) > rank(b); });
  std::vector<PoseFix> different;
  for (const PoseFix& fix : fixes) {
    if (!fix.inliers.empty() && std::all_of(different.begin(), different.end(), [&](const PoseFix& better) {
          return isOtherPlace(fix.map_from_vehicle, better.map_from_vehicle);
        })) {
      different.push_back(fix);
    }
  }
  return different;
}

PoseFix MapLocalizer::localizeAnywhere(const RigFeatures& features) const {
  const std::vector<PoseFix> fixes = localizeEverywhere(features);
  if (fixes.empty()) {
    return fixWithoutPose(LandmarkMatches());
  }
  PoseFix best = fixes.front();
  for (size_t i = 1; i < fixes.size(); ++i) {
    best.second_best_ratio = std::max(
        best.second_best_ratio, static_cast<double>(fixes[i].numInliers()) / std::max(1, best.numInliers()));
  }
  if (best.status == LocalizationStatus::kLocalized && best.second_best_ratio > options_.max_ambiguity) {
    best.status = LocalizationStatus::kAmbiguous;
  }
  return best;
}

}  // namespace vcharge
