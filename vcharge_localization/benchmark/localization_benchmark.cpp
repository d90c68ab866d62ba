// Measures the stages of a frame of four cameras in a map of 200,000 landmarks and 3.4 million observations,
// and the time to load such a map. Uses all cores.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

#include "vcharge_core/sparse_map/analytic_map.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_reconstruction/map_localizer.h"
#include "vcharge_reconstruction/testing/test_map.h"

namespace vcharge {
namespace {

constexpr int kRounds = 68;  // number of side-by-side circles that the vehicle drives
constexpr int kKeyframesPerRound = 60;
constexpr int kLandmarksPerRound = 3000;
constexpr int kNeighbours = 5;  // number of keyframes before and after that observe a landmark
constexpr double kRadius_m = 20.0, kSpacing_m = 100.0;
constexpr double kPi = 3.14159265358979323846;

/// Four copies of the analytic map's front camera, one to each side.
CameraRig makeRig() {
  AnalyticMapOptions options;
  options.num_keyframes = options.num_landmarks = 1;
  const CameraRig analytic = makeAnalyticMap(options).rig;
  CameraRig rig;
  const char* const names[] = {"front", "left", "rear", "right"};
  for (int i = 0; i < 4; ++i) {
    RigCamera camera = analytic.cameras[0];
    camera.name = names[i];
    camera.frame_id = std::string("camera_") + names[i] + "_optical";
    camera.vehicle_from_camera =
        RigidTransform::planar(1.3, 0.0, 0.0) * RigidTransform::planar(0.0, 0.0, 0.5 * kPi * i) *
        RigidTransform(analytic.cameras[0].vehicle_from_camera->rotation(), Eigen::Vector3d(2.0, 0.0, 0.6));
    rig.cameras.push_back(camera);
  }
  return rig;
}

RigidTransform poseOf(int round, double angle) {
  return RigidTransform::planar(kRadius_m * std::sin(angle) + kSpacing_m * round,
                                kRadius_m * (1.0 - std::cos(angle)), angle);
}

/// Adds a landmark that keyframes of its round observe.
void addLandmark(int round, std::mt19937* random, SparseMapContents* contents) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const int own = std::min(kKeyframesPerRound - 1, static_cast<int>(unit(*random) * kKeyframesPerRound));
  const double angle = 2.0 * kPi * unit(*random);
  const double distance_m = 5.0 + 10.0 * unit(*random);
  const double height_m = 3.0 * unit(*random);
  const size_t begin = static_cast<size_t>(round) * kKeyframesPerRound;
  MapLandmark landmark;
  landmark.position_m = contents->keyframes[begin + static_cast<size_t>(own)].map_from_vehicle *
                        Eigen::Vector3d(distance_m * std::cos(angle), distance_m * std::sin(angle), height_m);
  bool is_seen = false;
  for (int i = std::max(0, own - kNeighbours); i <= std::min(kKeyframesPerRound - 1, own + kNeighbours);
       ++i) {
    const size_t keyframe = begin + static_cast<size_t>(i);
    const Eigen::Vector3d point =
        contents->keyframes[keyframe].map_from_vehicle.inverse() * landmark.position_m;
    for (size_t k = 0; k < contents->rig.cameras.size(); ++k) {
      const RigCamera& camera = contents->rig.cameras[k];
      const Eigen::Vector3d ray = camera.vehicle_from_camera->inverse() * point;
      Eigen::Vector2d pixel;
      if (ray.z() < 0.1 * ray.norm() || !camera.model.project(ray, &pixel) || pixel.minCoeff() < 0.0 ||
          pixel.x() > camera.image_size_px.width - 1 || pixel.y() > camera.image_size_px.height - 1) {
        continue;
      }
      is_seen = true;
      contents->observations.push_back({static_cast<int32_t>(keyframe), static_cast<int32_t>(k),
                                        static_cast<int32_t>(contents->landmarks.size()),
                                        pixel.cast<float>()});
    }
  }
  if (is_seen) {
    contents->landmarks.push_back(landmark);
  }
}

/// Gives each landmark a descriptor, with different bits flipped in every observation.
void addDescriptors(SparseMapContents* contents) {
  const int num_landmarks = static_cast<int>(contents->landmarks.size());
  cv::Mat of_landmarks(num_landmarks, 32, CV_8UC1);
  cv::RNG random(2);
  random.fill(of_landmarks, cv::RNG::UNIFORM, 0, 256);
  contents->descriptors.create(static_cast<int>(contents->observations.size()), 32, CV_8UC1);
  for (int i = 0; i < contents->descriptors.rows; ++i) {
    cv::Mat row = contents->descriptors.row(i);
    of_landmarks.row(contents->observations[static_cast<size_t>(i)].landmark).copyTo(row);
    for (int k = 0; k < 8; ++k) {
      const int bit = random.uniform(0, 256);
      row.at<uchar>(bit / 8) ^= static_cast<uchar>(1 << (bit % 8));
    }
  }
}

const std::shared_ptr<const SparseMap>& largeMap() {
  static const std::shared_ptr<const SparseMap> kMap = [] {
    SparseMapContents contents;
    contents.rig = makeRig();
    contents.feature_options = "type: fast_brief\n";
    std::mt19937 random(1);
    for (int round = 0; round < kRounds; ++round) {
      for (int i = 0; i < kKeyframesPerRound; ++i) {
        MapKeyframe keyframe;
        keyframe.stamp = Timestamp::fromNanoseconds(
            1'000'000'000 * (int64_t{1} + static_cast<int64_t>(contents.keyframes.size())));
        keyframe.map_from_vehicle = poseOf(round, 2.0 * kPi * i / kKeyframesPerRound);
        contents.keyframes.push_back(keyframe);
      }
      for (int i = 0; i < kLandmarksPerRound; ++i) {
        addLandmark(round, &random, &contents);
      }
    }
    addDescriptors(&contents);
    return std::make_shared<const SparseMap>(std::move(contents));
  }();
  return kMap;
}

std::shared_ptr<const CameraRig> largeRig() {
  return {largeMap(), &largeMap()->rig()};
}

const MapLocalizer& localizer() {
  static const MapLocalizer kLocalizer(std::make_shared<const TiledMap>(largeMap()), largeRig());
  return kLocalizer;
}

const std::string& mapPath() {
  static const std::string kPath =
      (std::filesystem::temp_directory_path() / "localization_benchmark.vmap").string();
  return kPath;
}

void describe(benchmark::State* state) {
  state->counters["landmarks"] = static_cast<double>(largeMap()->landmarks().size());
  state->counters["observations"] = static_cast<double>(largeMap()->observations().size());
}

void describe(const RigFeatures& view, const PoseFix& fix, benchmark::State* state) {
  double num_features = 0.0;
  for (const ImageFeatures& image : view.images) {
    num_features += static_cast<double>(image.size());
  }
  state->counters["features"] = num_features;
  state->counters["inliers"] = fix.numInliers();
  state->counters["localized"] = fix.status == LocalizationStatus::kLocalized ? 1.0 : 0.0;
}

RigidTransform truePose() {
  return poseOf(kRounds / 2, 1.0);
}

RigFeatures view() {
  return testing::makeTestView(*largeMap(), truePose(), testing::TestViewOptions());
}

void features(benchmark::State& state) {
  cv::Mat image(800, 1280, CV_8UC1);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, cv::Size(9, 9), 2.5);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  const std::vector<Image> images(largeRig()->cameras.size(), Image{image, nullptr});
  for (auto _ : state) {
    benchmark::DoNotOptimize(localizer().extract(images, FrameMotion()).images.data());
  }
}
BENCHMARK(features)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void guidedSearch(benchmark::State& state) {
  const RigFeatures seen = view();
  PosePrior prior;
  prior.map_from_vehicle = truePose() * RigidTransform::planar(0.05, -0.03, 0.005);
  prior.covariance.diagonal() << 0.0025, 0.0025, 0.0001, 1e-6, 1e-6, 2.5e-5;
  PoseFix fix;
  for (auto _ : state) {
    fix = localizer().localizeNear(seen, prior);
  }
  describe(seen, fix, &state);
}
BENCHMARK(guidedSearch)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void wholeMap(benchmark::State& state) {
  const RigFeatures seen = view();
  PoseFix fix;
  for (auto _ : state) {
    fix = localizer().localizeAnywhere(seen);
  }
  describe(seen, fix, &state);
}
BENCHMARK(wholeMap)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void readMap(benchmark::State& state) {
  writeSparseMap(*largeMap(), {}, mapPath());
  for (auto _ : state) {
    benchmark::DoNotOptimize(readSparseMap(mapPath()));
  }
  describe(&state);
}
BENCHMARK(readMap)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void prepareMap(benchmark::State& state) {
  const auto rig = largeRig();
  for (auto _ : state) {
    const MapLocalizer prepared(std::make_shared<const TiledMap>(largeMap()), rig);
    benchmark::DoNotOptimize(&prepared);
  }
  describe(&state);
}
BENCHMARK(prepareMap)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

/// Does everything between the start and the first frame.
void readAndPrepareMap(benchmark::State& state) {
  const auto rig = largeRig();
  writeSparseMap(*largeMap(), {}, mapPath(), indexForTiles(*largeMap()));
  for (auto _ : state) {
    const MapLocalizer prepared(std::make_shared<const TiledMap>(mapPath()), rig);
    benchmark::DoNotOptimize(&prepared);
  }
  describe(&state);
}
BENCHMARK(readAndPrepareMap)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  std::filesystem::remove(vcharge::mapPath());
  return 0;
}
