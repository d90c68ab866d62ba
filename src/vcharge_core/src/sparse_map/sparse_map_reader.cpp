#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sparse_map/map_rows.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

using namespace map_file;

/// SQLite's own check covers what no hash covers, and locates the damage.
void checkIntegrity(const MapRows& file) {
  SqliteStatement check(file.database(), "PRAGMA integrity_check(1)");
  if (!check.step() || check.text(0) != "ok") {
    file.damaged(check.text(0));
  }
}

/// Reads one version as a whole.
class WholeMap {
 public:
  explicit WholeMap(const MapRows& file) : file_(file) {}

  SparseMapContents read(const MapProvenance& provenance) {
    file_.readHead(provenance, &contents_);
    readKeyframes();
    readLandmarks();
    if (!file_.hasVersions()) {  // ids count from 0
      contents_.next_keyframe_id = static_cast<int32_t>(contents_.keyframes.size());
      contents_.next_landmark_id = static_cast<int32_t>(contents_.landmarks.size());
    }
    readImages();
    readLoopEdges();
    return std::move(contents_);
  }

 private:
  void readKeyframes() {
    SqliteStatement select = file_.keyframes("ORDER BY id");
    while (select.step()) {
      contents_.keyframes.push_back(file_.keyframeOf(select, true));
      keyframe_ids_.push_back(contents_.keyframes.back().id);
    }
  }

  void readLandmarks() {
    SqliteStatement select = file_.landmarks("ORDER BY id");
    while (select.step()) {
      contents_.landmarks.push_back(file_.landmarkOf(select));
      landmark_ids_.push_back(contents_.landmarks.back().id);
    }
  }

  /// Checks the size of the descriptors before allocating them.
  cv::Mat allocateDescriptors() const {
    const auto [type, columns] = file_.descriptorLayout();
    uint64_t num_rows = 0;
    SqliteStatement select = file_.rows("image", "num_observations", "");
    while (select.step()) {
      num_rows += static_cast<uint64_t>(file_.indexOf(select, 0, "image"));
    }
    // An observation needs at least an index and a position.
    constexpr uint64_t kMinObservationSize = sizeof(int32_t) + 2 * sizeof(float);
    const uint64_t row_size = static_cast<uint64_t>(columns) * static_cast<uint64_t>(CV_ELEM_SIZE(type));
    if (num_rows > fs::file_size(file_.path()) / (kMinObservationSize + row_size) ||
        num_rows > static_cast<uint64_t>(std::numeric_limits<int32_t>::max())) {
      file_.damaged("image: more observations than the file holds");
    }
    return cv::Mat(static_cast<int>(num_rows), columns, type);
  }

  void readImages() {
    cv::Mat& descriptors = contents_.descriptors;
    descriptors = allocateDescriptors();
    const size_t row_bytes = descriptors.cols * descriptors.elemSize();
    const auto num_rows = static_cast<size_t>(descriptors.rows);
    contents_.observations.reserve(num_rows);
    SqliteStatement select = file_.images("ORDER BY id");
    while (select.step()) {
      MapRows::Image image = file_.imageOf(select);
      const size_t begin = contents_.observations.size(), count = image.observations.size();
      if (count > num_rows - begin) {
        file_.damaged("image: more observations than counted");
      }
      file_.copyDescriptors(select, count, row_bytes,
                            count == 0 ? nullptr : descriptors.ptr(static_cast<int>(begin)));
      const int32_t keyframe = file_.indexIn(keyframe_ids_, image.keyframe_id, "image: keyframe");
      for (MapObservation& observation : image.observations) {
        observation.keyframe = keyframe;
        observation.landmark = file_.indexIn(landmark_ids_, observation.landmark, "image: landmark");
        contents_.observations.push_back(observation);
      }
    }
    if (contents_.observations.size() != num_rows) {
      file_.damaged("image: fewer observations than counted");
    }
  }

  void readLoopEdges() {
    SqliteStatement select = file_.rows(
        "loop_edge", "id, first, second, x_m, y_m, z_m, qx, qy, qz, qw, num_inliers, accepted, reason",
        "ORDER BY id");
    while (select.step()) {
      const std::string owner = "loop_edge " + std::to_string(select.integer(0));
      contents_.loop_edges.push_back({file_.indexIn(keyframe_ids_, select.integer(1), owner + ": first"),
                                      file_.indexIn(keyframe_ids_, select.integer(2), owner + ": second"),
                                      file_.transformOf(select, 3, owner),
                                      file_.indexOf(select, 10, "loop_edge"), select.integer(11) != 0,
                                      select.text(12)});
    }
  }

  const MapRows& file_;
  SparseMapContents contents_;
  std::vector<int32_t> keyframe_ids_, landmark_ids_;
};

}  // namespace

std::shared_ptr<const SparseMap> readSparseMap(const std::string& path, MapProvenance* provenance,
                                               std::optional<int64_t> version) {
  MapRows file(path);
  checkIntegrity(file);
  if (version) {
    file.select(*version);
  }
  try {
    MapProvenance read_provenance = file.readProvenance();
    auto map = std::make_shared<const SparseMap>(WholeMap(file).read(read_provenance));
    // Files of the oldest schema hold a hash without sessions.
    if (file.meta("content_hash") !=
        (file.hasVersions() ? map->contentHash() : map->contentHashWithoutSessions())) {
      file.damaged("its content does not match the written hash");
    }
    if (provenance != nullptr) {
      *provenance = std::move(read_provenance);
    }
    return map;
  } catch (const std::logic_error& error) {  // from SparseMap and its parts about their arguments
    file.damaged(error.what());
  } catch (const cv::Exception& error) {
    file.damaged(error.what());
  }
}

std::vector<MapVersion> readMapVersions(const std::string& path) {
  MapRows file(path);
  checkIntegrity(file);
  std::vector<MapVersion> versions;
  for (const int64_t number : file.versions()) {
    file.select(number);
    versions.push_back({number, file.meta("content_hash"), file.readProvenance()});
  }
  return versions;
}

}  // namespace vcharge
