// Compares solveBundle() with Ceres (SPARSE_SCHUR, analytic derivatives) on the landmarks of a map: both on
// one thread, and as stages run them, solveBundle() on all threads and Ceres, for the same result on any
// number of threads, on one.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <functional>
#include <random>
#include <string>

#include <tbb/global_control.h>

#include "adjustment/ceres_bundle.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_reconstruction/bundle_solver.h"

namespace {

using namespace vcharge;

constexpr double kObservationSigma_px = 0.4;
// Noise of the initial values, and of the odometer's motions.
constexpr double kPoseNoise_m = 0.02, kPoseNoise_rad = 0.002, kPointNoise_m = 0.05;
constexpr double kOdometrySigma_m = 0.005, kOdometrySigma_rad = 0.002, kHeightSigma_m = 0.02,
                 kTiltSigma_rad = 0.01;

class Noise {
 public:
  Eigen::Vector3d operator()(double sigma) {
    return sigma * Eigen::Vector3d(normal_(random_), normal_(random_), normal_(random_));
  }

 private:
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_{0.0, 1.0};
};

/// The adjustment of a map from disturbed poses and points, with odometer factors between its keyframes.
BundleProblem makeProblem(const SparseMap& map) {
  Noise noise;
  BundleProblem problem;
  problem.rig = std::make_shared<const CameraRig>(map.rig());
  problem.odometer_sigmas = {0.03, 0.05};
  Eigen::Matrix<double, 6, 1> sigmas;
  sigmas << kOdometrySigma_m, kOdometrySigma_m, kHeightSigma_m, kTiltSigma_rad, kTiltSigma_rad,
      kOdometrySigma_rad;
  const std::vector<MapKeyframe>& keyframes = map.keyframes();
  for (size_t k = 0; k < keyframes.size(); ++k) {
    const RigidTransform& pose = keyframes[k].map_from_vehicle;
    if (k == 0) {
      problem.map_from_vehicle.push_back(pose);
      continue;
    }
    problem.map_from_vehicle.emplace_back(rotationFromVector(noise(kPoseNoise_rad)) * pose.rotation(),
                                          pose.translation() + noise(kPoseNoise_m));
    problem.odometer_factors.push_back({static_cast<int32_t>(k),
                                        keyframes[k - 1].map_from_vehicle.inverse() * pose,
                                        sigmas.cwiseAbs2().cwiseInverse().asDiagonal()});
  }
  for (size_t i = 0; i < map.landmarks().size(); ++i) {
    problem.points_in_map.push_back(map.landmarks()[i].position_m + noise(kPointNoise_m));
    problem.first_observation.push_back(problem.observations.size());
    const auto [begin, end] = map.observationsOfLandmark(i);
    for (const int32_t* index = begin; index != end; ++index) {
      const MapObservation& observation = map.observations()[*index];
      problem.observations.push_back({observation.keyframe, observation.camera,
                                      observation.position_px.cast<double>(), kObservationSigma_px});
    }
  }
  problem.first_observation.push_back(problem.observations.size());
  return problem;
}

struct Seconds {
  double processor = 0.0;  ///< hardly affected by other work on the machine
  double wall = 0.0;
};

Seconds measure(const std::function<void()>& work) {
  const std::clock_t start = std::clock();
  const auto wall_start = std::chrono::steady_clock::now();
  work();
  return {static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count()};
}

double costOf(BundleProblem problem) {
  return solveBundle(0, 1.0, &problem).cost;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Compares solveBundle() with Ceres on the landmarks of a map; prints times, costs and the ratio.");
  std::string path;
  int iterations = 25;
  double tolerance = 3e-3;
  app.addOption("--map", &path, "the map (*.vmap)").required();
  app.addOption("--iterations", &iterations, "largest number of iterations").showDefault();
  app.addOption("--tolerance", &tolerance, "relative decrease of the cost that ends them").showDefault();
  app.setFooter("Keys of --json: solve_bundle_s, solve_bundle_wall_s, ceres_s.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    BundleProblem ours = makeProblem(*readSparseMap(path));
    BundleProblem theirs = ours;
    std::printf("%zu poses, %zu points, %zu observations, initial cost %.6g\n", ours.map_from_vehicle.size(),
                ours.points_in_map.size(), ours.observations.size(), costOf(ours));
    BundleProblem parallel = ours;
    Seconds our_time;
    {
      const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
      our_time = measure([&] { solveBundle(iterations, tolerance, &ours); });
    }
    const Seconds parallel_time = measure([&] { solveBundle(iterations, tolerance, &parallel); });
    const Seconds their_time = measure([&] { testing::solveWithCeres(iterations, tolerance, &theirs); });
    double difference_m = 0.0;
    for (size_t i = 0; i < ours.map_from_vehicle.size(); ++i) {
      difference_m = std::max(
          difference_m,
          (ours.map_from_vehicle[i].translation() - theirs.map_from_vehicle[i].translation()).norm());
    }
    std::printf("solveBundle: %.3f s, cost %.9g\nCeres: %.3f s, cost %.9g\n", our_time.processor,
                costOf(ours), their_time.processor, costOf(theirs));
    std::printf("largest difference of positions: %.3g m\n", difference_m);
    std::printf(
        "Ceres / solveBundle: %.2f in processor time on one thread, %.2f in wall time as stages run\n",
        their_time.processor / our_time.processor, their_time.wall / parallel_time.wall);
    *found = {{"solve_bundle_s", our_time.processor},
              {"solve_bundle_wall_s", parallel_time.wall},
              {"ceres_s", their_time.processor}};
  });
}
