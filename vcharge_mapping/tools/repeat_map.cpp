// Makes a map of many kilometres out of maps of a few hundred metres, to measure localization in large maps.
#include <cmath>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_description.h"
#include "vcharge_mapping/session_merger.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace {

using namespace vcharge;

constexpr double kSpacing_m = 300.0;

struct Arguments {
  std::vector<std::string> maps;
  std::string output;
  double length_m = 20000.0;
  uint32_t seed = 1;
};

/// Changes the same bits of all descriptors: their distances from each other stay, those from other copies
/// become those of other places.
void changeBits(uint32_t seed, cv::Mat* descriptors) {
  std::mt19937 random(seed);
  cv::Mat mask(1, descriptors->cols, CV_8UC1);
  for (int i = 0; i < mask.cols; ++i) {
    mask.at<uint8_t>(0, i) = static_cast<uint8_t>(random());
  }
  for (int row = 0; row < descriptors->rows; ++row) {
    cv::Mat bits = descriptors->row(row);
    cv::bitwise_xor(bits, mask, bits);
  }
}

/// Appends a copy as a component of its own. Copy 0 stays where it is; the others lie on a square spiral.
void append(const SparseMap& map, int copy, uint32_t bits_seed, SparseMapContents* all) {
  const int ring = static_cast<int>(std::ceil((std::sqrt(copy + 1.0) - 1.0) / 2.0));
  const int side = 2 * ring, step = copy - (2 * ring - 1) * (2 * ring - 1);
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
  if (ring > 0) {
    const int edge = step / side, along = step % side - ring + 1;
    const int x[] = {ring, -along, -ring, along}, y[] = {along, ring, -along, -ring};
    offset_m = kSpacing_m * Eigen::Vector3d(x[edge], y[edge], 0.0);
  }
  const auto first_session = static_cast<int32_t>(all->sessions.size());
  const auto first_keyframe = static_cast<int32_t>(all->keyframes.size());
  const auto first_landmark = static_cast<int32_t>(all->landmarks.size());
  for (MapSession session : map.sessions()) {
    session.component = copy;
    all->sessions.push_back(std::move(session));
  }
  for (MapKeyframe keyframe : map.keyframes()) {
    keyframe.map_from_vehicle = RigidTransform(keyframe.map_from_vehicle.rotation(),
                                               keyframe.map_from_vehicle.translation() + offset_m);
    keyframe.session += first_session;
    keyframe.id = kNoId;
    all->keyframes.push_back(keyframe);
  }
  for (MapLandmark landmark : map.landmarks()) {
    landmark.position_m += offset_m;
    landmark.id = kNoId;
    all->landmarks.push_back(landmark);
  }
  for (MapObservation observation : map.observations()) {
    observation.keyframe += first_keyframe;
    observation.landmark += first_landmark;
    all->observations.push_back(observation);
  }
  cv::Mat descriptors = map.descriptors().clone();
  if (bits_seed > 0) {
    changeBits(bits_seed, &descriptors);
  }
  all->descriptors.push_back(descriptors);
}

void repeat(const Arguments& arguments, nlohmann::json* found) {
  std::vector<std::shared_ptr<const SparseMap>> maps;
  for (const std::string& path : arguments.maps) {
    maps.push_back(readSparseMap(path));
    if (maps.back()->descriptors().type() != CV_8UC1) {
      throw InputError(path + ": expected a map with binary descriptors");
    }
    requireSameRig(*maps.front(), *maps.back(), path);
  }
  SparseMapContents all;
  all.rig = maps[0]->rig();
  all.sessions.clear();
  all.descriptors.create(0, maps[0]->descriptors().cols, CV_8UC1);
  all.feature_options = maps[0]->contents().feature_options;
  double length_m = 0.0;
  int copies = 0;
  for (; length_m < arguments.length_m; ++copies) {
    const size_t round = static_cast<size_t>(copies) / maps.size();
    const SparseMap& map = *maps[static_cast<size_t>(copies) % maps.size()];
    append(map, copies, round == 0 ? 0 : arguments.seed + static_cast<uint32_t>(copies), &all);
    length_m += lengthOf_m(map);
  }
  const SparseMap map(std::move(all));
  writeSparseMap(map, {{"program", "repeat_map 0.1.0"}, {"change", "repeated"}}, arguments.output,
                 indexForTiles(map));
  *found = {{"length_m", length_m},
            {"copies", copies},
            {"num_keyframes", map.keyframes().size()},
            {"num_landmarks", map.landmarks().size()}};
  std::cout << found->dump() << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Writes a large map for measurements: copies of maps beside each other. The first stays where it is, "
      "and "
      "the copies of a second round and later have other descriptors.");
  Arguments arguments;
  app.addOption("--maps", &arguments.maps, "maps of one rig with binary descriptors (*.vmap)")
      .required()
      .check(requireNotEmpty);
  app.addOption("--output", &arguments.output, "map to write (*.vmap)").required().check(requireOutput);
  app.addOption("--length-m", &arguments.length_m, "least length of all drives in it").positive();
  app.addOption("--seed", &arguments.seed, "of the changed descriptors");
  app.setFooter("Keys of --json: length_m, copies, num_keyframes, num_landmarks.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) { repeat(arguments, found); });
}
