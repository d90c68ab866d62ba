#include <algorithm>
#include <cstdio>
#include <vector>

#include "tool_arguments.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_evaluation/map_errors.h"

namespace {

using namespace vcharge;

constexpr double kDegreesPerRadian = 57.29577951308232;
constexpr size_t kMaxDrawnLandmarks = 20000;

void printRevisits(const char* label, const RevisitCount& count) {
  std::printf("  %-34s %6d of %6d  %6.2f %%\n", label, count.num_found, count.num_keyframes,
              100.0 * count.fraction());
}

void print(const MapErrors& errors) {
  std::printf("keyframes: %zu over %.1f m, %d without truth\n", errors.keyframes.poses.size(),
              errors.keyframes.truth_length_m, errors.num_keyframes_without_truth);
  std::printf("  position (m), aligned: rms %.4f, 50 %% %.4f, 90 %% %.4f, max %.4f\n",
              errors.keyframes.position_m.root_mean_square, errors.keyframes.position_m.percentile_50,
              errors.keyframes.position_m.percentile_90, errors.keyframes.position_m.max);
  std::printf("  rotation (deg): rms %.4f, max %.4f\n",
              kDegreesPerRadian * errors.keyframes.rotation_rad.root_mean_square,
              kDegreesPerRadian * errors.keyframes.rotation_rad.max);
  std::printf("  scale: %+.4f %%\n", 100.0 * errors.scale_error);
  std::printf("accepted loop edges: %d, of these wrong: %d\n", errors.num_accepted, errors.num_wrong);
  std::printf("  error: 50 %% %.4f m and %.4f deg, 90 %% %.4f m and %.4f deg, max %.4f m and %.4f deg\n",
              errors.accepted_m.percentile_50, kDegreesPerRadian * errors.accepted_rad.percentile_50,
              errors.accepted_m.percentile_90, kDegreesPerRadian * errors.accepted_rad.percentile_90,
              errors.accepted_m.max, kDegreesPerRadian * errors.accepted_rad.max);
  std::printf("keyframes at a position passed before, with a correct edge:\n");
  printRevisits("in any heading", errors.revisits);
  printRevisits("same heading", errors.same);
  printRevisits("opposite heading", errors.opposite);
  printRevisits("opposite heading alone, any edge", errors.only_opposite);
  std::printf("rejected loop edges:\n");
  for (const auto& [reason, edges] : errors.rejected) {
    std::printf("  %6d, of these correct: %6d  %s\n", edges.num_edges, edges.num_right, reason.c_str());
  }
}

nlohmann::json toJson(const RevisitCount& count) {
  return {
      {"num_keyframes", count.num_keyframes}, {"num_found", count.num_found}, {"fraction", count.fraction()}};
}

nlohmann::json positionsFromAbove(const Trajectory& trajectory) {
  nlohmann::json path = nlohmann::json::array();
  for (const StampedTransform& entry : trajectory) {
    path.push_back({entry.world_from_vehicle.translation().x(), entry.world_from_vehicle.translation().y()});
  }
  return path;
}

nlohmann::json toJson(const SparseMap& map, const MapErrors& errors, const Trajectory& truth) {
  nlohmann::json rejected = nlohmann::json::object();
  for (const auto& [reason, edges] : errors.rejected) {
    rejected[reason] = {{"num_edges", edges.num_edges}, {"num_right", edges.num_right}};
  }
  nlohmann::json edges = nlohmann::json::array();
  for (size_t i = 0; i < errors.edges.size(); ++i) {
    const MapLoopEdge& edge = map.contents().loop_edges[i];
    const LoopEdgeJudgement& judgement = errors.edges[i];
    edges.push_back({{"first", edge.first},
                     {"second", edge.second},
                     {"accepted", edge.accepted},
                     {"reason", edge.reason},
                     {"num_inliers", edge.num_inliers},
                     {"has_truth", judgement.has_truth},
                     {"right", judgement.is_right},
                     {"opposite", judgement.is_opposite},
                     {"distance_m", judgement.distance_m},
                     {"error_m", judgement.error_m},
                     {"error_rad", judgement.error_rad}});
  }
  nlohmann::json keyframes = nlohmann::json::array();
  for (size_t k = 0; k < map.keyframes().size(); ++k) {
    const Eigen::Vector3d position =
        errors.truth_from_map * map.keyframes()[k].map_from_vehicle.translation();
    keyframes.push_back({{"x_m", position.x()},
                         {"y_m", position.y()},
                         {"z_m", position.z()},
                         {"revisit", static_cast<bool>(errors.is_revisit[k])},
                         {"found", static_cast<bool>(errors.is_found[k])}});
  }
  nlohmann::json landmarks = nlohmann::json::array();
  const size_t step = std::max<size_t>(1, map.landmarks().size() / kMaxDrawnLandmarks);
  for (size_t i = 0; i < map.landmarks().size(); i += step) {
    const Eigen::Vector3d position = errors.truth_from_map * map.landmarks()[i].position_m;
    landmarks.push_back({position.x(), position.y()});
  }
  return {{"kind", "map"},
          {"content_hash", map.contentHash()},
          {"num_keyframes", map.keyframes().size()},
          {"num_landmarks", map.landmarks().size()},
          {"num_observations", map.observations().size()},
          {"truth_length_m", errors.keyframes.truth_length_m},
          {"position_m", errors.keyframes.position_m},
          {"rotation_rad", errors.keyframes.rotation_rad},
          {"scale_error", errors.scale_error},
          {"num_accepted", errors.num_accepted},
          {"num_wrong", errors.num_wrong},
          {"accepted_m", errors.accepted_m},
          {"accepted_rad", errors.accepted_rad},
          {"revisits", toJson(errors.revisits)},
          {"same_heading", toJson(errors.same)},
          {"opposite_heading", toJson(errors.opposite)},
          {"only_opposite_heading", toJson(errors.only_opposite)},
          {"rejected", rejected},
          {"edges", edges},
          {"keyframes", keyframes},
          {"landmarks", landmarks},
          {"truth_path", positionsFromAbove(truth)}};
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Errors of a sparse map against the true trajectory: its keyframes, and its accepted and rejected loop "
      "edges.");
  std::string map_path, truth_path;
  app.addOption("--map", &map_path, "map to judge (.vmap)").required().check(requireNotEmpty);
  app.addOption("--truth", &truth_path, "true trajectory (.tum)").required();
  const OptionsArgument<MapErrorOptions> options(&app);
  const ReportArgument report(&app, "map_errors");
  describeJson(&app, R"(kind: "map"; content_hash; num_keyframes, num_landmarks, num_observations;
truth_length_m; scale_error; error distributions of the aligned keyframes position_m, rotation_rad, and
of the accepted edges accepted_m, accepted_rad; num_accepted, num_wrong; revisits, same_heading,
opposite_heading, only_opposite_heading: keyframes at a position passed before {num_keyframes, num_found,
fraction}; rejected: per reason {num_edges, num_right}; edges: [{first, second, accepted, reason,
num_inliers, has_truth, right, opposite, distance_m, error_m, error_rad}]; keyframes: [{x_m, y_m, z_m,
revisit, found}]; landmarks, truth_path: [[x_m, y_m]].)");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (options.shown()) {
      return;
    }
    const MapErrorOptions error_options = options.read();
    const auto map = readSparseMap(map_path);
    const Trajectory truth = readTrajectory(truth_path);
    MapErrors errors;
    try {
      errors = evaluateMap(*map, truth, error_options);
    } catch (const InputError& error) {
      throw InputError(map_path + " against " + truth_path + ": " + error.what());
    }
    print(errors);
    *found = toJson(*map, errors, truth);
    report.write(*found);
  });
}
