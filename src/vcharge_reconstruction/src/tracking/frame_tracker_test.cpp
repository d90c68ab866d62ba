#include "vcharge_reconstruction/frame_tracker.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

constexpr int kSide_px = 400;
const Eigen::Vector2d kCentre_px(199.5, 199.5);
constexpr int kFramesPerKeyframe = 4;

RigCamera makeCamera() {
  PinholeCamera::Parameters parameters;
  parameters << 400.0, 400.0, kCentre_px.x(), kCentre_px.y(), 0.0, 0.0, 0.0, 0.0;
  return {"front", "camera_front_optical", {kSide_px, kSide_px}, PinholeCamera(parameters)};
}

/// A wall with texture of all sizes.
cv::Mat makeWall() {
  cv::RNG random(5);
  cv::Mat sum = cv::Mat::zeros(4 * kSide_px, 4 * kSide_px, CV_32F);
  for (const double blur_px : {1.5, 3.0, 6.0, 12.0}) {
    cv::Mat noise(sum.size(), CV_32F), smooth;
    random.fill(noise, cv::RNG::NORMAL, 0.0, 1.0);
    cv::GaussianBlur(noise, smooth, {}, blur_px);
    sum += smooth * (30.0 * blur_px);
  }
  cv::Mat wall;
  sum.convertTo(wall, CV_8U, 1.0, 128.0);
  return wall;
}

/// The wall as the camera sees it: its middle at `shift_px`, magnified by `scale`.
Image look(const cv::Mat& wall, double scale, double shift_px) {
  cv::Mat smooth = wall;
  if (scale < 1.0) {
    cv::GaussianBlur(wall, smooth, {}, 0.6 * std::sqrt(1.0 / (scale * scale) - 1.0) + 1e-3);
  }
  const double middle_px = 2.0 * kSide_px - 0.5;
  const cv::Matx23d wall_from_image(1.0 / scale, 0.0, middle_px - (kCentre_px.x() + shift_px) / scale, 0.0,
                                    1.0 / scale, middle_px - kCentre_px.y() / scale);
  Image image;
  cv::warpAffine(smooth, image.pixels, wall_from_image, {kSide_px, kSide_px},
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  return image;
}

/// Tracks of a camera before the wall, which shrinks and shifts by these amounts from frame to frame.
class WallDrive {
 public:
  WallDrive(int num_keyframes, double scale_per_frame, double shift_per_frame_px)
      : scale_per_frame_(scale_per_frame), shift_per_frame_px_(shift_per_frame_px) {
    const RigCamera camera = makeCamera();
    const FrameTrackerOptions options;
    const auto extractor = makeFeatureExtractor();
    const cv::Mat wall = makeWall();
    CameraTracker tracker(camera, options);
    for (int frame = 0; frame <= (num_keyframes - 1) * kFramesPerKeyframe; ++frame) {
      std::vector<RayMatch> matches;
      tracker.track(look(wall, scaleAt(frame), frame * shift_per_frame_px), RigidTransform(), ImageMotion(),
                    0, &matches);
      if (frame % kFramesPerKeyframe == 0) {
        const auto keyframe = static_cast<int32_t>(data.keyframes.size());
        data.keyframes.emplace_back();
        data.keyframes.back().images.resize(1);
        tracker.readKeyframe(keyframe, *extractor, &data.keyframes.back().images[0]);
        tracker.addKeyframe(keyframe, 0, &data);
      }
    }
  }

  double scaleAtKeyframe(int32_t keyframe) const { return scaleAt(keyframe * kFramesPerKeyframe); }

  /// Distance of a track's last observation from where its first one is then.
  double drift_px(const Track& track) const {
    const TrackObservation &first = track.observations.front(), &last = track.observations.back();
    const double scale = scaleAtKeyframe(last.keyframe) / scaleAtKeyframe(first.keyframe);
    return (last.position_px - middleAt(last.keyframe) -
            scale * (first.position_px - middleAt(first.keyframe)))
        .norm();
  }

  ReconstructionData data;

 private:
  double scaleAt(int frame) const { return std::pow(scale_per_frame_, frame); }
  Eigen::Vector2d middleAt(int32_t keyframe) const {
    return kCentre_px + Eigen::Vector2d(keyframe * kFramesPerKeyframe * shift_per_frame_px_, 0.0);
  }

  const double scale_per_frame_, shift_per_frame_px_;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

TEST(FrameTrackerTest, FollowsAPatchThatOnlyMovesFromEndToEnd) {
  const WallDrive drive(8, 1.0, 2.0);
  std::vector<double> drifts_px, sigmas_px;
  for (const Track& track : drive.data.tracks) {
    if (track.observations.front().keyframe == 0 && track.observations.back().keyframe == 7) {
      drifts_px.push_back(drive.drift_px(track));
      sigmas_px.push_back(track.observations.back().sigma_px);
    }
  }
  ASSERT_GT(drifts_px.size(), 50);
  EXPECT_LT(median(drifts_px), 0.1);
  EXPECT_LT(median(sigmas_px), 1.2 * FrameTrackerOptions().tracking_sigma_px) << "anchors do not change";
}

TEST(FrameTrackerTest, EndsATrackWhenItsPatchHasShrunkByHalf) {
  const WallDrive drive(12, 0.97, 0.0);
  std::vector<double> drifts_px;
  size_t num_too_long = 0, num_long = 0;
  for (const Track& track : drive.data.tracks) {
    if (track.observations.size() < 3 || track.observations.back().sigma_px > 0.9) {
      continue;  // slipped: how its patch was deformed meanwhile is not known
    }
    const double shrunk = drive.scaleAtKeyframe(track.observations.front().keyframe) /
                          drive.scaleAtKeyframe(track.observations.back().keyframe);
    num_long += shrunk > 1.6 ? 1 : 0;
    num_too_long += shrunk > 2.4 ? 1 : 0;
    drifts_px.push_back(drive.drift_px(track));
  }
  ASSERT_GT(num_long, 100);
  EXPECT_LT(num_too_long, 0.1 * num_long) << "some settle on a wrong deformation";
  EXPECT_LT(median(drifts_px), 0.6);
}

TEST(FrameTrackerTest, EndsAllTracksWhereAnImageIsMissing) {
  const RigCamera camera = makeCamera();
  const FrameTrackerOptions options;
  const cv::Mat wall = makeWall();
  CameraTracker tracker(camera, options);
  ReconstructionData data;
  data.keyframes.resize(3);
  std::vector<RayMatch> matches;
  for (int32_t keyframe = 0; keyframe < 3; ++keyframe) {
    data.keyframes[keyframe].images.resize(1);
    tracker.track(keyframe == 1 ? Image() : look(wall, 1.0, 0.0), RigidTransform(), ImageMotion(), 0,
                  &matches);
    tracker.readKeyframe(keyframe, *makeFeatureExtractor(), &data.keyframes[keyframe].images[0]);
    tracker.addKeyframe(keyframe, 0, &data);
  }
  EXPECT_TRUE(matches.empty());
  ASSERT_FALSE(data.tracks.empty());
  for (const Track& track : data.tracks) {
    EXPECT_EQ(track.observations.size(), 1);
  }
}

/// Current directions of the matches of a camera with extrinsics, between two images in which points move 8
/// pixels to the right.
std::vector<RayMatch> matchesOf(const ImageTiming& timing, double yaw_rate_rad_per_s, double image_offset_s) {
  RigCamera camera = makeCamera();
  camera.vehicle_from_camera = RigidTransform();
  camera.timing = timing;
  const FrameTrackerOptions options;
  const auto extractor = makeFeatureExtractor();
  const cv::Mat wall = makeWall();
  CameraTracker tracker(camera, options);
  const ImageMotion motion{{2.0, yaw_rate_rad_per_s}, image_offset_s};
  std::vector<RayMatch> matches;
  ReconstructionData data;
  data.keyframes.resize(1);
  data.keyframes[0].images.resize(1);
  tracker.track(look(wall, 1.0, 0.0), RigidTransform(), motion, 0, &matches);
  tracker.readKeyframe(0, *extractor, &data.keyframes[0].images[0]);
  tracker.addKeyframe(0, 0, &data);
  tracker.track(look(wall, 1.0, 8.0), RigidTransform(), motion, 0, &matches);
  return matches;
}

TEST(FrameTrackerTest, MatchesKnowHowMuchLaterALineIsExposed) {
  const std::vector<RayMatch> at_once = matchesOf(ImageTiming(), 0.5, 0.0);
  // Points move along the lines' order by 8 of 400 columns, or across it.
  const std::vector<RayMatch> along = matchesOf({0.02, ReadoutDirection::kRight, 0.0}, 0.5, 0.0);
  const std::vector<RayMatch> across = matchesOf({0.02, ReadoutDirection::kDown, 0.0}, 0.5, 0.03);
  ASSERT_GT(at_once.size(), 50U);
  ASSERT_EQ(along.size(), at_once.size());
  ASSERT_EQ(across.size(), at_once.size());
  constexpr double kTurn_rad = 0.5 * 0.02 * 8.0 / kSide_px;
  for (size_t i = 0; i < at_once.size(); ++i) {
    const Eigen::Vector3d turned =
        rotationFromYawPitchRoll(kTurn_rad, 0.0, 0.0) * at_once[i].current.direction;
    EXPECT_LT((along[i].current.direction - turned).norm(), 0.2 * kTurn_rad);
    EXPECT_LT((across[i].current.direction - at_once[i].current.direction).norm(), 0.2 * kTurn_rad);
    EXPECT_EQ(along[i].previous.direction, at_once[i].previous.direction);
    EXPECT_TRUE(along[i].current.origin_m.isZero(0.0));
  }
}

}  // namespace
}  // namespace vcharge
