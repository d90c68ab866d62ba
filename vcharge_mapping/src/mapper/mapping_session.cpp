#include "vcharge_mapping/mapping_session.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// Keyframes from one part of the drive to the next, at least.
constexpr size_t kMinPartKeyframes = 20;

/// Exception that ends the mapper's work.
struct Abandoned {};

}  // namespace

MappingSession::MappingSession(std::shared_ptr<const CameraRig> rig, const SparseMapperOptions& options,
                               KeyframeCallback on_keyframe, MapCallback on_map)
    : rig_(std::move(rig)),
      options_(options),
      on_keyframe_(std::move(on_keyframe)),
      on_map_(std::move(on_map)),
      mapper_(std::make_unique<SparseMapper>(rig_, options_)) {
  tell();
}

MappingSession::~MappingSession() {
  stop_ = true;
  for (std::thread* worker : {&worker_, &part_worker_}) {
    if (worker->joinable()) {
      worker->join();
    }
  }
}

void MappingSession::giveParts(MapCallback on_part) {
  const std::lock_guard<std::mutex> lock(mutex_);
  on_part_ = std::move(on_part);
}

void MappingSession::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (status().phase != Phase::kFollowing) {
    const std::lock_guard<std::mutex> status_lock(status_mutex_);
    status_.counts.back().second = ++num_ignored_images_;
    return;
  }
  mapper_->addImage(camera_index, stamp, image);
  tell();
}

void MappingSession::addOdometry(const VehicleOdometry& odometry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (status().phase == Phase::kFollowing) {
    mapper_->addOdometry(odometry);
    tell();
  }
}

void MappingSession::tell() {
  const ReconstructionReport& report = mapper_->report();
  const size_t num_keyframes = mapper_->state().data.keyframes.size();
  {
    const std::lock_guard<std::mutex> lock(status_mutex_);
    status_.counts = {{"frames", report.counters.frames},
                      {"keyframes", static_cast<int64_t>(num_keyframes)},
                      {"frames that lack a camera", report.counters.incomplete_frames},
                      {"frames without odometry", report.counters.frames_without_odometry},
                      {"standing frames", report.num_standing_frames},
                      {"late images", report.counters.numLateImages()},
                      {"images after finish", num_ignored_images_}};
    status_.message = num_keyframes == 0 ? "waiting for a drive"
                                         : "following: " + std::to_string(num_keyframes) + " keyframes";
  }
  if (num_keyframes > num_keyframes_told_) {
    num_keyframes_told_ = num_keyframes;
    on_keyframe_(mapper_->state());
  }
  if (on_part_ && !makes_part_ &&
      num_keyframes >= num_keyframes_of_part_ + std::max(kMinPartKeyframes, num_keyframes_of_part_ / 10)) {
    num_keyframes_of_part_ = num_keyframes;
    startPart();
  }
}

void MappingSession::startPart() {
  if (part_worker_.joinable()) {
    part_worker_.join();  // it has returned
  }
  makes_part_ = true;
  part_worker_ = std::thread([this, state = mapper_->state()]() mutable { makePart(std::move(state)); });
}

void MappingSession::makePart(ReconstructionState state) {
  std::string not_kept;
  try {
    on_part_(*makeMapSoFar(std::move(state), options_));
  } catch (const std::exception& error) {
    not_kept = error.what();
  }
  {
    const std::lock_guard<std::mutex> lock(status_mutex_);
    status_.not_kept = not_kept;
  }
  makes_part_ = false;
}

bool MappingSession::finish(std::string* message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  {
    const std::lock_guard<std::mutex> status_lock(status_mutex_);
    if (status_.phase != Phase::kFollowing) {
      *message = status_.phase == Phase::kFinishing ? "the map is being made: " + status_.message
                                                    : "the map was made before";
      return false;
    }
    status_.phase = Phase::kFinishing;
    status_.message = "finishing";
    status_.failure.clear();
  }
  if (worker_.joinable()) {
    worker_.join();  // it has returned, and its drive gave no map
  }
  worker_ = std::thread([this] { run(); });
  *message = "making the map of " + std::to_string(mapper_->state().data.keyframes.size()) +
             " keyframes; /diagnostics shows the progress";
  return true;
}

void MappingSession::run() {
  if (part_worker_.joinable()) {
    part_worker_.join();  // no other begins in this phase
  }
  std::string failure;
  std::shared_ptr<const SparseMap> map;
  try {
    map = mapper_->finish([this](const StageProgress& progress) {
      if (stop_) {
        throw Abandoned();
      }
      const std::lock_guard<std::mutex> lock(status_mutex_);
      status_.message = "stage " + std::to_string(progress.number) + " of " +
                        std::to_string(progress.num_stages) + ", " + progress.stage + ": " +
                        std::to_string(static_cast<int>(100.0 * progress.fraction)) + " %";
    });
  } catch (const Abandoned&) {
    return;
  } catch (const std::exception& error) {
    failure = error.what();
  }
  if (map) {
    on_map_(*map);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (map) {
    mapper_.reset();  // frees the features of the images
  } else {
    mapper_ = std::make_unique<SparseMapper>(rig_, options_);
    num_keyframes_told_ = num_keyframes_of_part_ = 0;
    tell();
  }
  const std::lock_guard<std::mutex> status_lock(status_mutex_);
  status_.failure = failure;
  status_.phase = map ? Phase::kFinished : Phase::kFollowing;
  if (map) {
    status_.message = "finished: " + std::to_string(map->keyframes().size()) + " keyframes, " +
                      std::to_string(map->landmarks().size()) + " landmarks, content hash " +
                      map->contentHash();
  }
  map_ = map;
}

MappingSession::Status MappingSession::status() const {
  const std::lock_guard<std::mutex> lock(status_mutex_);
  return status_;
}

std::shared_ptr<const SparseMap> MappingSession::map() const {
  const std::lock_guard<std::mutex> lock(status_mutex_);
  return map_;
}

std::shared_ptr<const SparseMap> MappingSession::requireMap() const {
  std::shared_ptr<const SparseMap> finished = map();
  if (!finished) {
    throw InputError("no map yet, expected one that ~finish made: " + status().message);
  }
  return finished;
}

}  // namespace vcharge
