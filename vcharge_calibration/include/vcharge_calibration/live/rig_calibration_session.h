#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "vcharge_calibration/live/calibration_coach.h"
#include "vcharge_calibration/rig/rig_calibrator.h"
#include "vcharge_core/frames/drive_source.h"

namespace vcharge {

/// Options of RigCalibrationSession.
struct RigCalibrationSessionOptions {
  VCHARGE_BEGIN_OPTIONS(RigCalibrationSessionOptions);
  VCHARGE_OPTION(bool, calibrates_itself, false, anyValue(),
                 "Calibrates once the coach finds the drive sufficient.");
  VCHARGE_OPTION(double, retry_m, 30.0, notNegative(),
                 "Distance after a failure until the next calibration.");
  VCHARGE_OPTION(double, outlook_m, 2.0, positive(), "Distance between updates of the outlook.");
  VCHARGE_OPTION(int, max_keyframes, 2000, atLeast(10), "Keyframes after which the drive is ignored.");
  VCHARGE_OPTION_GROUP(CalibrationCoachOptions, coach, {}, "Requirements on a drive.");
  VCHARGE_END_OPTIONS();
};

/// A calibration and the reconstruction that it came from.
struct FinishedCalibration {
  RigCalibration result;
  ReconstructionState state;
  KeyframeImages images;
};

/// Calibrates a rig while the vehicle is driven: feeds a RigCalibrator, updates the outlook of a
/// CalibrationCoach, and calibrates in a thread of its own from the drive so far. The drive may continue
/// meanwhile, and be calibrated again. The source serializes the calls of DriveConsumer; the others may come
/// from any thread.
class RigCalibrationSession : public DriveConsumer {
 public:
  /// kFailed lasts until the drive continues, kCalibrated until the next calibration or reset.
  enum class Phase { kFollowing, kCalibrating, kCalibrated, kFailed };
  struct Status {
    Phase phase = Phase::kFollowing;
    std::string message;    ///< one line: the current activity, the result, or the reason of a failure
    double progress = 0.0;  ///< of a running calibration, otherwise of the drive
    DriveOutlook outlook;
    std::shared_ptr<const RigCalibration> result;         ///< the last one of this drive; null before
    std::vector<std::pair<std::string, int64_t>> counts;  ///< of frames, keyframes and skipped frames
  };
  /// Called from the drive's thread and from that of the calibration; may only call status().
  using StatusCallback = std::function<void(const Status&)>;
  /// Called in the calibration's thread with every result, also failures. An exception makes the calibration
  /// fail with its text.
  using ResultCallback = std::function<void(const FinishedCalibration&)>;
  /// Called inside addImage() and addOdometry() after an update of the outlook; the rig has the extrinsics of
  /// hand-eye calibration where they are known.
  using DriveCallback = std::function<void(const ReconstructionState&, const CameraRig& guess)>;

  /// Callbacks but `on_result` must not throw. Errors as RigCalibrator; std::invalid_argument for bad
  /// options.
  RigCalibrationSession(std::shared_ptr<const CameraRig> rig, const RigCalibratorOptions& calibrator_options,
                        const RigCalibrationSessionOptions& options, StatusCallback on_status,
                        DriveCallback on_drive, ResultCallback on_result);
  /// Abandons a running calibration at the end of its stage.
  ~RigCalibrationSession() override;
  RigCalibrationSession(const RigCalibrationSession&) = delete;
  RigCalibrationSession& operator=(const RigCalibrationSession&) = delete;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// Starts to calibrate from the drive so far. False while a calibration runs; `message` has the state.
  bool calibrate(std::string* message);
  /// Starts a new drive, and abandons a running calibration at the end of its stage.
  void reset();

  Status status() const;

 private:
  struct Follower;
  struct Job;
  template <class Feed>
  void follow(const Feed& feed);
  bool begin(bool flushes, std::string* message);
  void run(const std::shared_ptr<Job>& job);
  void startOver();
  void updateOutlook();
  void tell(const std::function<void(Status*)>& change);

  const std::shared_ptr<const CameraRig> rig_;
  const RigCalibratorOptions calibrator_options_;
  const RigCalibrationSessionOptions options_;
  const StatusCallback on_status_;
  const DriveCallback on_drive_;
  const ResultCallback on_result_;

  std::mutex mutex_;  // guards the following members
  std::unique_ptr<Follower> follower_;
  std::shared_ptr<Job> job_;  // the last one; null before the first
  std::thread worker_;        // of job_

  mutable std::mutex status_mutex_;  // never held during work
  Status status_;
};

}  // namespace vcharge
