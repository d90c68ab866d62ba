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

/// Maps a drive while it comes in: feeds a SparseMapper, and makes the map in a thread of its own, during
/// which and after which what comes is counted and not used. A drive that makes no map is forgotten, and a
/// new one begins. The drive's calls are serialized by their source; the others may come from any thread.
class MappingSession : public DriveConsumer {
 public:
  enum class Phase { kFollowing, kFinishing, kFinished };
  struct Status {
    Phase phase = Phase::kFollowing;
    std::string message;  ///< one line
    std::string failure;  ///< why the last drive made no map; empty where none failed
    std::vector<std::pair<std::string, int64_t>> counts;  ///< of frames, keyframes, what was skipped
  };
  using KeyframeCallback = std::function<void(const MappingState&)>;
  using MapCallback = std::function<void(const SparseMap&)>;

  /// `on_keyframe` is called inside addImage() and addOdometry(), whenever there are more keyframes than
  /// before; `on_map` in the thread that made the map. Neither may throw. Errors as SparseMapper.
  MappingSession(std::shared_ptr<const CameraRig> rig, const SparseMapperOptions& options,
                 KeyframeCallback on_keyframe, MapCallback on_map);
  /// Gives up a map that is being made, at the end of its stage.
  ~MappingSession() override;
  MappingSession(const MappingSession&) = delete;
  MappingSession& operator=(const MappingSession&) = delete;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// Begins to make the map of what came so far and returns. False where that was begun before; `message`
  /// says so.
  bool finish(std::string* message);

  Status status() const;
  /// Null before it is made.
  std::shared_ptr<const SparseMap> map() const;

 private:
  void run();
  void tell();

  const std::shared_ptr<const CameraRig> rig_;
  const SparseMapperOptions options_;
  const KeyframeCallback on_keyframe_;
  const MapCallback on_map_;

  std::mutex mutex_;  // guards the mapper while following; the worker alone has it while finishing
  std::unique_ptr<SparseMapper> mapper_;
  size_t num_keyframes_told_ = 0;

  mutable std::mutex status_mutex_;  // never held during work
  Status status_;
  int64_t num_ignored_images_ = 0;  // that came after finish()
  std::shared_ptr<const SparseMap> map_;

  std::atomic<bool> stop_{false};
  std::thread worker_;
};

}  // namespace vcharge
