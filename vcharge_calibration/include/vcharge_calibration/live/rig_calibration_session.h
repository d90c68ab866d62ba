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
  bool calibrates_itself = false;  ///< once the coach says that the drive is enough
  double retry_m = 30.0;           ///< driven on after a failure before it calibrates itself again
  double outlook_m = 2.0;          ///< way between two looks of the coach
  double outlook_turn_rad = 0.3;   ///< or turn
  int max_keyframes = 2000;        ///< further ones are not taken: a calibration has no use for them
  CalibrationCoachOptions coach;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("calibrates_itself", calibrates_itself);
    visit("retry_m", retry_m);
    visit("outlook_m", outlook_m);
    visit("outlook_turn_rad", outlook_turn_rad);
    visit("max_keyframes", max_keyframes);
    visit("coach", coach);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// A calibration and all that it was made of.
struct FinishedCalibration {
  RigCalibration result;
  MappingState state;
  KeyframeImages images;
};

/// Calibrates a rig while it is driven: feeds a RigCalibrator, lets a CalibrationCoach watch, and calibrates
/// the drive until then in a thread of its own. Following goes on meanwhile and after: a drive that did not
/// suffice may be driven further and calibrated again. The drive's calls are serialized by their source; the
/// others may come from any thread.
class RigCalibrationSession : public DriveConsumer {
 public:
  /// kFailed until the drive goes on, kCalibrated until it is calibrated again, or forgotten.
  enum class Phase { kFollowing, kCalibrating, kCalibrated, kFailed };
  struct Status {
    Phase phase = Phase::kFollowing;
    std::string message;    ///< one line: what happens, how it ended, or why it failed
    double progress = 0.0;  ///< of the calibration, where one runs; otherwise of the drive
    DriveOutlook outlook;
    std::shared_ptr<const RigCalibration> result;         ///< the last one of this drive; null before
    std::vector<std::pair<std::string, int64_t>> counts;  ///< of frames, keyframes, what was skipped
  };
  /// Called from the drive's thread and from that of the calibration; may ask for status() and no more.
  using StatusCallback = std::function<void(const Status&)>;
  /// Called in the calibration's thread with every result, also failures; writes files, shows pictures. What
  /// it throws makes the calibration fail with that text.
  using ResultCallback = std::function<void(const FinishedCalibration&)>;
  /// Called inside addImage() and addOdometry() when the coach has looked; the rig is that of hand-eye, whose
  /// cameras lack extrinsics where nothing can be told yet.
  using DriveCallback = std::function<void(const MappingState&, const CameraRig& guess)>;

  /// Callbacks but `on_result` must not throw. Errors as RigCalibrator; std::invalid_argument for bad
  /// options.
  RigCalibrationSession(std::shared_ptr<const CameraRig> rig, const RigCalibratorOptions& calibrator_options,
                        const RigCalibrationSessionOptions& options, StatusCallback on_status,
                        DriveCallback on_drive, ResultCallback on_result);
  /// Gives up a calibration that runs, at the end of its stage.
  ~RigCalibrationSession() override;
  RigCalibrationSession(const RigCalibrationSession&) = delete;
  RigCalibrationSession& operator=(const RigCalibrationSession&) = delete;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// Begins to calibrate by what came so far and returns. False where that is being done; `message` says so.
  bool calibrate(std::string* message);
  /// Forgets the drive, and gives up a calibration of it that runs, at the end of its stage: a new drive
  /// begins at once.
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
  void look();
  void tell(const std::function<void(Status*)>& change);

  const std::shared_ptr<const CameraRig> rig_;
  const RigCalibratorOptions calibrator_options_;
  const RigCalibrationSessionOptions options_;
  const StatusCallback on_status_;
  const DriveCallback on_drive_;
  const ResultCallback on_result_;

  std::mutex mutex_;  // guards what follows
  std::unique_ptr<Follower> follower_;
  std::shared_ptr<Job> job_;  // the last one; null before
  std::thread worker_;        // of job_

  mutable std::mutex status_mutex_;  // never held during work
  Status status_;
};

}  // namespace vcharge
