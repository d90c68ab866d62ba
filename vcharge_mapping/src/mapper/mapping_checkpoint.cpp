// A checkpoint, little-endian: 8 bytes "VCHCHECK", int32 version, 32 hexadecimal digits of the key, the state
// in the order of its members, 32 hexadecimal digits: XXH3-128 of everything before them.
#include "vcharge_mapping/mapping_checkpoint.h"

#include <cerrno>
#include <filesystem>
#include <sstream>
#include <utility>

#include "mapper/state_archive.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {

// Every member by a structured binding: a member that is new does not compile until it is kept too. Each is
// transferred in the order of its struct.
template <class Archive, class... Members>
void transferAll(Archive& archive, Members&... members) {
  (transfer(archive, members), ...);
}

template <class Archive>
void transfer(Archive& archive, Keypoint& keypoint) {
  auto& [position_px, size_px, angle_rad, response] = keypoint;
  transferAll(archive, position_px.x, position_px.y, size_px, angle_rad, response);
}

template <class Archive>
void transfer(Archive& archive, ImageFeatures& features) {
  auto& [keypoints, descriptors] = features;
  transferAll(archive, keypoints, descriptors);
}

template <class Archive>
void transfer(Archive& archive, KeyframeImage& image) {
  auto& [features, rays, tracks] = image;
  transferAll(archive, features, rays, tracks);
}

template <class Archive>
void transfer(Archive& archive, Keyframe& keyframe) {
  auto& [stamp, odom_from_vehicle, map_from_vehicle, travelled_m, images] = keyframe;
  transferAll(archive, stamp, odom_from_vehicle, map_from_vehicle, travelled_m, images);
}

template <class Archive>
void transfer(Archive& archive, TrackObservation& observation) {
  auto& [keyframe, camera, feature, position_px, sigma_px] = observation;
  transferAll(archive, keyframe, camera, feature, position_px, sigma_px);
}

template <class Archive>
void transfer(Archive& archive, Track& track) {
  auto& [observations, position_m, covariance_m2] = track;
  transferAll(archive, observations, position_m, covariance_m2);
}

template <class Archive>
void transfer(Archive& archive, MappingData& data) {
  auto& [rig, keyframes, tracks, distance_scale, turn_scale] = data;
  static_cast<void>(rig);  // part of the key
  transferAll(archive, keyframes, tracks, distance_scale, turn_scale);
}

template <class Archive>
void transfer(Archive& archive, FramePose& frame) {
  auto& [stamp, keyframe, keyframe_from_vehicle, motion] = frame;
  transferAll(archive, stamp, keyframe, keyframe_from_vehicle, motion);
}

template <class Archive>
void transfer(Archive& archive, SkippedFrames& skipped) {
  auto& [reason, first, last, num_frames] = skipped;
  transferAll(archive, reason, first, last, num_frames);
}

template <class Archive>
void transfer(Archive& archive, LoopEdge& edge) {
  auto& [first, second, first_from_second, covariance, num_inliers, is_planar, accepted, reason] = edge;
  transferAll(archive, first, second, first_from_second, covariance, num_inliers, is_planar, accepted,
              reason);
}

template <class Archive>
void transfer(Archive& archive, SparseMapperReport& report) {
  auto& [frames, incomplete, without_odometry, standing, resets, late, missing, skipped, motions, landmarks,
         observations, rms_px, loop_edges, stage_s] = report;
  transferAll(archive, frames, incomplete, without_odometry, standing, resets, late, missing, skipped,
              motions, landmarks, observations, rms_px, loop_edges, stage_s);
}

template <class Archive>
void transfer(Archive& archive, std::shared_ptr<const VocabularyTree>& vocabulary) {
  std::string bytes = vocabulary && !Archive::kReads ? vocabulary->serialize() : std::string();
  transfer(archive, bytes);
  if constexpr (Archive::kReads) {
    vocabulary = bytes.empty()
                     ? nullptr
                     : std::make_shared<const VocabularyTree>(VocabularyTree::parse(bytes, "vocabulary"));
  }
}

template <class Archive>
void transfer(Archive& archive, MappingState& state) {
  auto& [data, frames, keyframe_from_next, report, vocabulary, num_finished_stages] = state;
  transferAll(archive, data, frames, keyframe_from_next, report, vocabulary, num_finished_stages);
}

namespace {

constexpr char kMagic[] = "VCHCHECK";
constexpr size_t kMagicSize = 8;
constexpr int32_t kVersion = 1;
constexpr size_t kHashSize = 32;
constexpr size_t kHeaderSize = kMagicSize + sizeof(kVersion) + kHashSize;

std::string hashOf(const char* data, size_t size) {
  ContentHasher hasher;
  hasher.addBytes(data, size);
  return hasher.hex();
}

}  // namespace

std::string checkpointKey(const std::string& drive_hash, const CameraRig& rig,
                          const SparseMapperOptions& options, const std::string& program) {
  ContentHasher hasher;
  hasher.add(drive_hash);
  hasher.add(program);
  hasher.add(formatCameraRig(rig));
  for (const RigCamera& camera : rig.cameras) {
    for (int row = 0; row < camera.mask.rows; ++row) {
      hasher.addBytes(camera.mask.ptr(row), static_cast<size_t>(camera.mask.cols));
    }
  }
  std::ostringstream text;
  text << writeFields(options);
  hasher.add(text.str());
  return hasher.hex();
}

void writeCheckpoint(const MappingState& state, const std::string& key, const std::string& path) {
  check(key.size() == kHashSize, "writeCheckpoint: expected a key of checkpointKey()");
  writeFileAtomically(path, [&](const std::string& temporary) {
    errno = 0;
    std::ofstream file(temporary, std::ios::binary);
    std::string hash;
    {
      ArchiveWriter archive(&file);
      std::string header(kMagic, kMagicSize);
      header.append(reinterpret_cast<const char*>(&kVersion), sizeof(kVersion));
      header += key;
      archive.bytes(header.data(), header.size());
      transfer(archive, const_cast<MappingState&>(state));  // a writer changes nothing
      archive.flush();
      hash = archive.hash();
    }
    file << hash;
    file.close();
    if (!file) {
      throw InputError(path + ": cannot be written: " + std::generic_category().message(errno));
    }
  });
}

CheckpointReading readCheckpoint(const std::string& path, const std::string& key,
                                 std::shared_ptr<const CameraRig> rig) {
  CheckpointReading result;
  if (!std::filesystem::exists(path)) {
    return result;
  }
  try {
    const std::string text = readTextFile(path);
    if (text.compare(0, kMagicSize, kMagic) != 0) {
      throw InputError("is no checkpoint");
    }
    if (text.size() < kHeaderSize + kHashSize) {
      throw InputError("truncated");
    }
    int32_t version = 0;
    std::memcpy(&version, text.data() + kMagicSize, sizeof(version));
    if (version != kVersion) {
      throw InputError("of format " + std::to_string(version) + ", expected " + std::to_string(kVersion));
    }
    if (text.compare(kMagicSize + sizeof(version), kHashSize, key) != 0) {
      throw InputError("made from another drive or rig, with other options or by another program");
    }
    const size_t end = text.size() - kHashSize;
    if (text.compare(end, kHashSize, hashOf(text.data(), end)) != 0) {
      throw InputError("truncated or damaged");
    }
    ArchiveReader archive(text.data() + kHeaderSize, text.data() + end);
    MappingState state;
    transfer(archive, state);
    if (!archive.isAtEnd()) {
      throw InputError("damaged");
    }
    state.data.rig = std::move(rig);
    result.state = std::move(state);
  } catch (const std::exception& error) {
    result.refusal = path + ": not gone on from: " + error.what();
  }
  return result;
}

}  // namespace vcharge
