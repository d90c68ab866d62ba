#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_localization/camera_health.h"
#include "vcharge_localization/pose_filter.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

struct DriveLocalizerOptions {
  VCHARGE_BEGIN_OPTIONS(DriveLocalizerOptions);
  VCHARGE_OPTION_GROUP(FrameAssemblerOptions, frames, FrameAssemblerOptions::waiting(0.2, 0.3), "Frames.");
  VCHARGE_OPTION_GROUP(MapLocalizerOptions, localizer, {}, "Pose from one frame.");
  VCHARGE_OPTION_GROUP(PoseFilterOptions, filter, {}, "Fusion with the odometry.");
  VCHARGE_OPTION_GROUP(CameraHealthOptions, health, {}, "Warnings about cameras.");
  VCHARGE_OPTION(double, lost_sigma_m, 1.0, positive(), "A less certain position is lost.");
  VCHARGE_OPTION(double, lost_sigma_rad, 0.1, positive(), "A less certain rotation is lost.");
  VCHARGE_OPTION(int, max_frames_without_fix, 5, atLeast(1), "Frames without a fix until relocalization.");
  VCHARGE_END_OPTIONS();
};

/// The pose at a frame, computed from this and earlier frames only.
struct LocalizationResult {
  Timestamp stamp;
  LocalizationStatus status = LocalizationStatus::kLost;
  std::optional<PosePrior> pose;  ///< set for kLocalized and kBridgedByOdometry
  PoseFix fix;                    ///< computed from this frame's images only
  bool searched_whole_map = false;
  double fix_distance = 0.0;  ///< squared Mahalanobis distance between the fix and the prediction
  double since_fix_s = 0.0;   ///< time since the last fix: 0 for kLocalized; infinite before the first
  std::optional<RigidTransform> odom_from_vehicle;
  std::string message;  ///< one line: the current activity, and its reason
  std::vector<std::string> camera_warnings;
  std::map<std::string, double> stage_s;
};

class PlaceHypotheses;

/// Localizes a vehicle in a map, frame by frame (paper, section Localization). Tracking: the pose is
/// predicted by the odometer and corrected by a fix from the images; frames without a fix are bridged.
/// Relocalization: a lost vehicle is searched in the whole map; a pose is accepted when one place remains and
/// two frames agree.
/// Not thread safe.
class DriveLocalizer {
 public:
  /// Throws the errors of MapLocalizer.
  DriveLocalizer(std::shared_ptr<const TiledMap> map, std::shared_ptr<const CameraRig> rig,
                 const DriveLocalizerOptions& options = DriveLocalizerOptions());
  ~DriveLocalizer();

  LocalizationResult process(const ImageFrame& frame);
  /// Processes a frame whose features were already extracted; its images are not used.
  LocalizationResult process(const ImageFrame& frame, const RigFeatures& features);

  /// Sets an external pose, for example from a user. There is no result until a frame confirms it; after
  /// max_frames_without_fix the whole map is searched.
  void seed(const PosePrior& pose);

  /// From now on cameras that moved are left out. At the beginning none has.
  void setCondition(const RigCondition& condition) { health_.setCondition(condition); }

  /// Takes over the pose of a localizer in another version of the same map, which a frame confirms. The
  /// frames of two versions differ by what the later drives corrected. InputError unless the rigs have the
  /// same cameras.
  void continueFrom(const DriveLocalizer& other);

  /// Returns to the state before the first frame.
  void forget();

  const MapLocalizer& localizer() const { return localizer_; }

 private:
  void localize(const ImageFrame& frame, const RigFeatures& features, LocalizationResult* result);
  void predict(const ImageFrame& frame);
  bool isLost() const;
  void track(const RigFeatures& features, LocalizationResult* result);
  void searchWholeMap(const ImageFrame& frame, const RigFeatures& features, LocalizationResult* result);
  void takeFix(const PoseFix& fix, LocalizationResult* result);

  const std::shared_ptr<const CameraRig> rig_;
  const DriveLocalizerOptions options_;
  const MapLocalizer localizer_;
  PoseFilter filter_;
  CameraHealth health_;
  std::optional<Timestamp> last_stamp_, last_fix_;
  std::optional<RigidTransform> last_odom_from_vehicle_;
  int64_t last_num_resets_ = 0;
  RigidTransform last_motion_;
  double last_period_s_ = 0.0;
  int frames_without_fix_ = 0;
  bool is_seed_ = false;  // the filter's pose is from seed() and not yet confirmed by images
  std::unique_ptr<PlaceHypotheses> hypotheses_;
};

}  // namespace vcharge
