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
    std::string message;   ///< one line: the current activity or result
    std::string failure;   ///< why the last drive gave no map; empty without a failure
    std::string not_kept;  ///< why on_part failed last; empty if it did not
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

  /// From now on, gives out the map of the drive so far (makeMapSoFar()) whenever it has grown by a tenth
  /// and 20 keyframes, in a thread of its own. `on_part` may throw std::exception.
  void giveParts(MapCallback on_part);

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
  void startPart();
  void makePart(ReconstructionState state);

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

  MapCallback on_part_;  // set before the drive
  size_t num_keyframes_of_part_ = 0;
  std::atomic<bool> makes_part_{false};

  std::atomic<bool> stop_{false};
  std::thread worker_, part_worker_;
};

}  // namespace vcharge
