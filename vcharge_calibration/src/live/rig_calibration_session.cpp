#include "vcharge_calibration/live/rig_calibration_session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <optional>

#include "live/live_motions.h"

namespace vcharge {
namespace {

/// Turn after which the coach updates its outlook.
constexpr double kOutlookTurn_rad = 0.3;
/// Part of the coach's distance after which a session that calibrates itself begins.
constexpr double kFirstDistance = 0.5;
/// A vehicle without a keyframe for so long stands.
constexpr double kStanding_s = 1.0;

/// Thrown through the calibration when it is abandoned.
struct Abandoned {};

std::vector<std::string> namesOf(const CameraRig& rig) {
  std::vector<std::string> names;
  for (const RigCamera& camera : rig.cameras) {
    names.push_back(camera.name);
  }
  return names;
}

CameraRig initialRig(const CameraRig& rig, const DriveOutlook& outlook) {
  CameraRig initial_rig = rig;
  for (size_t i = 0; i < initial_rig.cameras.size(); ++i) {
    const HandEye& hand_eye = outlook.cameras[i].hand_eye;
    initial_rig.cameras[i].covariance.reset();
    initial_rig.cameras[i].vehicle_from_camera.reset();
    if (hand_eye.status == HandEyeStatus::kOk) {
      initial_rig.cameras[i].vehicle_from_camera = hand_eye.vehicle_from_camera;
    }
  }
  return initial_rig;
}

std::vector<std::pair<std::string, int64_t>> countsOf(const ReconstructionState& state) {
  const ReconstructionReport& report = state.report;
  return {{"frames", report.counters.frames},
          {"keyframes", static_cast<int64_t>(state.data.keyframes.size())},
          {"frames that lack a camera", report.counters.incomplete_frames},
          {"frames without odometry", report.counters.frames_without_odometry},
          {"standing frames", report.num_standing_frames},
          {"late images", report.counters.numLateImages()}};
}

std::string describe(const RigCalibration& result) {
  std::string text = toString(result.verdict);
  for (const std::string& remark : result.remarks) {
    text += "; " + remark;
  }
  return text;
}

}  // namespace

/// The state of one drive.
struct RigCalibrationSession::Follower {
  RigCalibrator calibrator;
  CalibrationCoach coach;
  DriveOutlook outlook;
  std::optional<Keyframe> last_outlook;  // keyframe at the coach's last outlook, without images
  // Number of keyframes, and driven distance, of the last calibration.
  size_t calibrated_keyframes = 0;
  double calibrated_m = 0.0;

  Follower(const std::shared_ptr<const CameraRig>& rig, const RigCalibratorOptions& calibrator_options,
           const CalibrationCoachOptions& coach_options)
      : calibrator(rig, calibrator_options),
        coach(namesOf(*rig), calibrator_options.hand_eye, coach_options),
        outlook(coach.outlook()) {}

  bool isOutlookDue(const RigCalibrationSessionOptions& options) const {
    const std::vector<Keyframe>& keyframes = calibrator.state().data.keyframes;
    if (keyframes.empty() || keyframes.size() == coach.numKeyframes()) {
      return false;
    }
    if (!last_outlook) {
      return true;
    }
    const double turn_rad = angleOfRotation(last_outlook->odom_from_vehicle.rotation().conjugate() *
                                            keyframes.back().odom_from_vehicle.rotation());
    return keyframes.back().travelled_m - last_outlook->travelled_m >= options.outlook_m ||
           turn_rad >= kOutlookTurn_rad;
  }

  /// Whether a calibration can begin from the drive so far. Others go on from it.
  bool canCalibrate(const CalibrationCoachOptions& options) const {
    const auto isKnown = [](const CameraOutlook& camera) {
      return camera.hand_eye.status == HandEyeStatus::kOk;
    };
    return outlook.distance_m >= kFirstDistance * options.enough_distance_m &&
           std::all_of(outlook.cameras.begin(), outlook.cameras.end(), isKnown);
  }

  void updateOutlook() {
    const ReconstructionState& state = calibrator.state();
    updateCoach(state, &coach);
    outlook = coach.outlook();
    last_outlook.emplace();
    last_outlook->odom_from_vehicle = state.data.keyframes.back().odom_from_vehicle;
    last_outlook->travelled_m = state.data.keyframes.back().travelled_m;
  }
};

/// A calibration that is running or finished.
struct RigCalibrationSession::Job {
  FinishedCalibration work;
  KeyframeImages all_images;
  std::optional<RigCalibrationState> earlier;  // of the same drive, from which it goes on
  bool is_early = false;                       // its failure is no news
  std::atomic<bool> is_abandoned{false}, is_done{false};
};

RigCalibrationSession::RigCalibrationSession(std::shared_ptr<const CameraRig> rig,
                                             const RigCalibratorOptions& calibrator_options,
                                             const RigCalibrationSessionOptions& options,
                                             StatusCallback on_status, DriveCallback on_drive,
                                             ResultCallback on_result)
    : rig_(std::move(rig)),
      calibrator_options_(calibrator_options),
      options_(options),
      on_status_(std::move(on_status)),
      on_drive_(std::move(on_drive)),
      on_result_(std::move(on_result)) {
  options_.validate();
  startOver();
}

RigCalibrationSession::~RigCalibrationSession() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_awaited_ = true;
    if (job_) {
      job_->is_abandoned = true;
    }
  }
  if (worker_.joinable()) {
    worker_.join();
  }
}

void RigCalibrationSession::tell(const std::function<void(Status*)>& change) {
  Status told;
  {
    const std::lock_guard<std::mutex> lock(status_mutex_);
    change(&status_);
    told = status_;
  }
  on_status_(told);
}

template <class Feed>
void RigCalibrationSession::follow(Timestamp now, const Feed& feed) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const ReconstructionState& state = follower_->calibrator.state();
  if (state.data.keyframes.size() < static_cast<size_t>(options_.max_keyframes)) {
    feed(&follower_->calibrator);
  }
  {
    const std::lock_guard<std::mutex> status_lock(status_mutex_);
    status_.counts = countsOf(state);
  }
  if (follower_->isOutlookDue(options_)) {
    updateOutlook();
  }
  now_ = now;
  if (isCalibrationDue()) {
    std::string message;
    begin(false, &message);
  }
}

/// Whether a session that calibrates itself should do so now.
bool RigCalibrationSession::isCalibrationDue() const {
  const std::vector<Keyframe>& keyframes = follower_->calibrator.state().data.keyframes;
  const bool is_free = !job_ || job_->is_done;
  if (!options_.calibrates_itself || !is_free || !follower_->canCalibrate(options_.coach) ||
      keyframes.size() == follower_->calibrated_keyframes) {
    return false;
  }
  const bool is_longer = keyframes.back().travelled_m - follower_->calibrated_m >= options_.again_m;
  const bool has_become_enough = job_ && job_->is_early && follower_->outlook.isEnough();
  return is_longer || has_become_enough || toSeconds(now_ - keyframes.back().stamp) > kStanding_s;
}

void RigCalibrationSession::updateOutlook() {
  Follower& follower = *follower_;
  follower.updateOutlook();
  const ReconstructionState& state = follower.calibrator.state();
  on_drive_(state, initialRig(*rig_, follower.outlook));
  tell([&](Status* status) {
    status->outlook = follower.outlook;
    if (status->phase == Phase::kFailed) {
      status->phase = Phase::kFollowing;  // the drive continues
    }
    if (status->phase == Phase::kFollowing) {
      status->message = follower.outlook.next;
      status->progress = follower.outlook.progress;
    }
  });
}

void RigCalibrationSession::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  follow(stamp, [&](RigCalibrator* calibrator) { calibrator->addImage(camera_index, stamp, image); });
}

void RigCalibrationSession::addOdometry(const VehicleOdometry& odometry) {
  follow(odometry.stamp, [&](RigCalibrator* calibrator) { calibrator->addOdometry(odometry); });
}

bool RigCalibrationSession::calibrate(std::string* message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return begin(true, message);
}

bool RigCalibrationSession::begin(bool is_asked_for, std::string* message) {
  if (job_ && !job_->is_done) {
    *message = job_->is_abandoned ? "the abandoned calibration is still ending: try again"
                                  : "already calibrating: " + status().message;
    return false;
  }
  if (worker_.joinable()) {
    is_awaited_ = true;
    worker_.join();  // returns at once or soon
    is_awaited_ = false;
  }
  *message = makeJob(is_asked_for);
  worker_ = std::thread([this, first = job_] {
    for (std::shared_ptr<Job> job = first; job; job = nextJob()) {
      run(job);
    }
  });
  return true;
}

/// Makes a job of the drive so far, and returns what it begins with in a line.
std::string RigCalibrationSession::makeJob(bool is_asked_for) {
  const std::shared_ptr<Job> previous = std::move(job_);
  job_ = std::make_shared<Job>();
  const bool is_adjusted = previous && previous->work.result.num_landmarks > 0;
  if (is_adjusted && !previous->is_abandoned) {
    job_->earlier = RigCalibrationState{previous->work.result, std::move(previous->work.state)};
  }
  if (is_asked_for) {
    follower_->calibrator.flush();
  }
  job_->work.state = follower_->calibrator.state();
  job_->work.images = follower_->calibrator.images();
  job_->all_images = follower_->calibrator.allImages();
  job_->is_early = !is_asked_for && !follower_->outlook.isEnough();
  const std::vector<Keyframe>& keyframes = job_->work.state.data.keyframes;
  follower_->calibrated_keyframes = keyframes.size();
  follower_->calibrated_m = keyframes.empty() ? 0.0 : keyframes.back().travelled_m;
  const std::string message = "calibrating from " + std::to_string(keyframes.size()) + " keyframes";
  if (!job_->is_early) {
    tell([&](Status* status) {
      status->phase = Phase::kCalibrating;
      status->message = message;
      status->progress = 0.0;
    });
  }
  return message;
}

/// In the worker's thread: what is due after its job, also if the drive has ended meanwhile; otherwise null.
std::shared_ptr<RigCalibrationSession::Job> RigCalibrationSession::nextJob() {
  std::unique_lock<std::mutex> lock(mutex_, std::defer_lock);
  while (!is_awaited_ && !lock.try_lock()) {  // who waits for this thread may hold the lock
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (is_awaited_ || !isCalibrationDue()) {
    return nullptr;
  }
  makeJob(false);
  return job_;
}

/// Calibrates; what goes on from an earlier calibration and fails is made again from the whole drive, unless
/// it is early.
void RigCalibrationSession::calibrate(Job* job, const StageCallback& progress) const {
  std::optional<ReconstructionState> whole_drive;
  if (job->earlier && !job->is_early) {
    whole_drive = job->work.state;
  }
  FinishedCalibration& work = job->work;
  work.result = calibrateFollowedDrive(calibrator_options_, job->all_images, progress, &work.state,
                                       std::move(job->earlier));
  if (whole_drive && work.result.verdict == Verdict::kFail) {
    work.state = std::move(*whole_drive);
    work.result = calibrateFollowedDrive(calibrator_options_, job->all_images, progress, &work.state);
  }
}

void RigCalibrationSession::run(const std::shared_ptr<Job>& job) {
  const auto tellOfJob = [&](const std::function<void(Status*)>& change) {
    tell([&](Status* status) {
      if (!job->is_abandoned) {  // otherwise the status belongs to another drive
        change(status);
      }
    });
  };
  Phase phase = Phase::kFailed;
  std::string message;
  try {
    calibrate(job.get(), [&](const StageProgress& progress) {
      if (job->is_abandoned) {
        throw Abandoned();
      }
      if (job->is_early) {
        return;
      }
      tellOfJob([&](Status* status) {
        status->message = "stage " + std::to_string(progress.number) + " of " +
                          std::to_string(progress.num_stages) + ", " + progress.stage;
        status->progress = (progress.number - 1 + progress.fraction) / progress.num_stages;
      });
    });
    if (job->is_abandoned) {
      throw Abandoned();
    }
    const bool has_failed = job->work.result.verdict == Verdict::kFail;
    if (job->is_early && has_failed) {
      job->is_done = true;  // no news
      return;
    }
    const std::string more = on_result_(job->work);
    message = describe(job->work.result) + (more.empty() ? "" : "; " + more);
    phase = has_failed ? Phase::kFailed : Phase::kCalibrated;
  } catch (const Abandoned&) {
    job->is_abandoned = true;  // tells nothing
  } catch (const std::exception& error) {
    message = error.what();
  }
  tellOfJob([&](Status* status) {
    if (!job->is_early || phase == Phase::kFailed) {
      status->phase = phase;
      status->progress = 1.0;
    }
    status->message = (job->is_early ? "so far " : "") + message;
    status->result = std::make_shared<const RigCalibration>(job->work.result);
  });
  job->is_done = true;
}

void RigCalibrationSession::startOver() {
  follower_ = std::make_unique<Follower>(rig_, calibrator_options_, options_.coach);
  const std::lock_guard<std::mutex> lock(status_mutex_);
  status_ = Status();
  status_.outlook = follower_->outlook;
  status_.message = "waiting for a drive";
  status_.counts = countsOf(follower_->calibrator.state());
}

void RigCalibrationSession::reset() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (job_) {
    job_->is_abandoned = true;
  }
  startOver();
  tell([](Status* /*status*/) {});
}

RigCalibrationSession::Status RigCalibrationSession::status() const {
  const std::lock_guard<std::mutex> lock(status_mutex_);
  return status_;
}

}  // namespace vcharge
