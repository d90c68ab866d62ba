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

#include "vcharge_core/frames/drive_source.h"
#include "vcharge_mapping/sparse_mapper.h"

namespace vcharge {

/// Maps a live drive: feeds a SparseMapper, and finishes the map in a separate thread. Images that arrive
/// after finish() are only counted. After a failure a new drive begins. The source must serialize the
/// calls of DriveConsumer; other functions may be called from any thread.
class MappingSession : public DriveConsumer {
 public:
  enum class Phase { kFollowing, kFinishing, kFinished };
  struct Status {
    Phase phase = Phase::kFollowing;
    std::string message;  ///< one line: the current activity or result
    std::string failure;  ///< why the last drive gave no map; empty without a failure
    std::vector<std::pair<std::string, int64_t>> counts;  ///< numbers of frames, keyframes and skipped frames
  };
  using KeyframeCallback = std::function<void(const ReconstructionState&)>;
  using MapCallback = std::function<void(const SparseMap&)>;

  /// `on_keyframe` is called inside addImage() and addOdometry() after new keyframes; `on_map` in the thread
  /// that made the map. Neither may throw. The constructor throws the errors of SparseMapper.
  MappingSession(std::shared_ptr<const CameraRig> rig, const SparseMapperOptions& options,
                 KeyframeCallback on_keyframe, MapCallback on_map);
  /// Abandons an unfinished map at the end of its stage.
  ~MappingSession() override;
  MappingSession(const MappingSession&) = delete;
  MappingSession& operator=(const MappingSession&) = delete;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// Starts to finish the map of the drive so far. False if that was started before; `message` has the state.
  bool finish(std::string* message);

  Status status() const;
  /// The finished map; null before.
  std::shared_ptr<const SparseMap> map() const;
  /// The finished map, or an InputError with the state.
  std::shared_ptr<const SparseMap> requireMap() const;

 private:
  void run();
  void tell();

  const std::shared_ptr<const CameraRig> rig_;
  const SparseMapperOptions options_;
  const KeyframeCallback on_keyframe_;
  const MapCallback on_map_;

  std::mutex mutex_;  // guards the mapper while following; while finishing only the worker uses it
  std::unique_ptr<SparseMapper> mapper_;
  size_t num_keyframes_told_ = 0;

  mutable std::mutex status_mutex_;  // never held during long work
  Status status_;
  int64_t num_ignored_images_ = 0;  // images after finish()
  std::shared_ptr<const SparseMap> map_;

  std::atomic<bool> stop_{false};
  std::thread worker_;
};

}  // namespace vcharge
