#pragma once

#include <atomic>
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
                 "Calibrates while the drive goes on, from half of the coach's distance on.");
  VCHARGE_OPTION(double, again_m, 20.0, notNegative(),
                 "Least distance between calibrations of a drive that goes on.");
  VCHARGE_OPTION(double, outlook_m, 2.0, positive(), "Distance between updates of the outlook.");
  VCHARGE_OPTION(int, max_keyframes, 2000, atLeast(10), "Keyframes after which the drive is ignored.");
  VCHARGE_OPTION_GROUP(CalibrationCoachOptions, coach, {}, "Requirements on a drive.");
  VCHARGE_END_OPTIONS();
};

/// A calibration and the reconstruction it was made from.
struct FinishedCalibration {
  RigCalibration result;
  ReconstructionState state;
  KeyframeImages images;
};

/// Calibrates a rig while the vehicle is driven: feeds a RigCalibrator, updates the outlook of a
/// CalibrationCoach, and calibrates in a separate thread from the drive so far. The drive may continue
/// meanwhile and be calibrated again: a session that calibrates itself does so whenever the drive has become
/// longer, and once more when the vehicle stops, so that a result is there at the end of the drive. Each
/// goes on from the one before. A calibration that fails before the coach has enough is not told. The source
/// must serialize the calls of DriveConsumer; other functions may be called from any thread.
class RigCalibrationSession : public DriveConsumer {
 public:
  /// kFailed lasts until the drive continues; kCalibrated lasts until the next calibration or reset.
  enum class Phase { kFollowing, kCalibrating, kCalibrated, kFailed };
  struct Status {
    Phase phase = Phase::kFollowing;
    std::string message;    ///< one line: the current activity, the result, or the reason of a failure
    double progress = 0.0;  ///< progress of a running calibration, otherwise of the drive
    DriveOutlook outlook;
    std::shared_ptr<const RigCalibration> result;         ///< last of this drive; null before
    std::vector<std::pair<std::string, int64_t>> counts;  ///< numbers of frames, keyframes and skipped frames
  };
  /// Called from the thread of the drive and from the thread of the calibration; may only call status().
  using StatusCallback = std::function<void(const Status&)>;
  /// Called in the calibration's thread with every result, including failures. Returns what the status should
  /// say besides, or nothing. If it throws, the calibration fails with the exception's text.
  using ResultCallback = std::function<std::string(const FinishedCalibration&)>;
  /// Called inside addImage() and addOdometry() after an update of the outlook; the rig has the extrinsics
  /// from hand-eye calibration as far as they are known.
  using DriveCallback = std::function<void(const ReconstructionState&, const CameraRig& initial_rig)>;

  /// Callbacks other than `on_result` must not throw. Errors as for RigCalibrator; std::invalid_argument
  /// for bad options.
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
  void follow(Timestamp now, const Feed& feed);
  bool isCalibrationDue() const;
  bool begin(bool is_asked_for, std::string* message);
  std::string makeJob(bool is_asked_for);
  std::shared_ptr<Job> nextJob();
  void calibrate(Job* job, const StageCallback& progress) const;
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
  std::shared_ptr<Job> job_;  // last job; null before the first
  std::thread worker_;        // thread of job_
  Timestamp now_;             // stamp of the newest image or odometry

  std::atomic<bool> is_awaited_{false};  // somebody waits for the end of the worker

  mutable std::mutex status_mutex_;  // never held during long work
  Status status_;
};

}  // namespace vcharge
