// Compares BagReader with librosbag: opening a recording, and reading all of its images and odometry, from a
// bag whose chunks are plain, or compressed by bz2 or lz4. To read another recording: BAG=DRIVE.bag
// bag_reader_benchmark.
#include <cstdlib>
#include <filesystem>
#include <string>

#include <benchmark/benchmark.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <opencv2/core.hpp>

#include "vcharge_recordings/bag_reader.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge {
namespace {

constexpr int kNumImages = 60;

// Smooth images with noise in the last bits, about as compressible as real ones.
void writeImages(const std::string& path, rosbag::CompressionType compression) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  bag.setCompression(compression);
  cv::Mat pixels(800, 1280, CV_8UC1), noise(pixels.size(), CV_8UC1);
  cv::RNG random(7);
  for (int i = 0; i < kNumImages; ++i) {
    for (int row = 0; row < pixels.rows; ++row) {
      const int gray = row / 4;
      pixels.row(row).setTo(gray);
    }
    random.fill(noise, cv::RNG::UNIFORM, 0, 4);
    bag.write("/camera/front/image_raw", ros::Time(1 + i, 0),
              *toImageMessage(pixels + noise, Timestamp::fromNanoseconds(i), "camera"));
    for (int k = 1; k <= 10; ++k) {
      bag.write("/odom", ros::Time(1 + i, k), nav_msgs::Odometry());
    }
  }
  bag.close();
}

/// The recording to read: a file that is made on first use, or the one that BAG names.
std::string recording(const benchmark::State& state) {
  if (const char* const path = std::getenv("BAG")) {
    return path;
  }
  const auto compression = static_cast<rosbag::CompressionType>(state.range(0));
  const std::string path =
      (std::filesystem::temp_directory_path() / ("bag_reader_benchmark_" + std::to_string(compression)))
          .string();
  if (!std::filesystem::exists(path)) {
    writeImages(path, compression);
  }
  return path;
}

void openByLibrosbag(benchmark::State& state) {
  const std::string path = recording(state);
  for (auto _ : state) {
    benchmark::DoNotOptimize(rosbag::Bag(path).getSize());
  }
}

void openByBagReader(benchmark::State& state) {
  const std::string path = recording(state);
  for (auto _ : state) {
    benchmark::DoNotOptimize(BagReader(path).topics().size());
  }
}

void readByLibrosbag(benchmark::State& state) {
  const std::string path = recording(state);
  size_t num_messages = 0;
  for (auto _ : state) {
    num_messages = 0;
    const rosbag::Bag bag(path);
    for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
      num_messages += message.instantiate<sensor_msgs::Image>() != nullptr ? 1 : 0;
      num_messages += message.instantiate<nav_msgs::Odometry>() != nullptr ? 1 : 0;
    }
  }
  state.counters["messages"] = static_cast<double>(num_messages);
}

void readByBagReader(benchmark::State& state) {
  const std::string path = recording(state);
  size_t num_messages = 0;
  for (auto _ : state) {
    num_messages = 0;
    BagReader bag(path);
    std::set<std::string> images, all;
    for (const auto& [topic, types] : bag.topics()) {
      if (types.count("sensor_msgs/Image") > 0) {
        images.insert(topic);
      }
      if (types.count("sensor_msgs/Image") > 0 || types.count("nav_msgs/Odometry") > 0) {
        all.insert(topic);
      }
    }
    for (const BagEntry& entry : bag.entries(all)) {
      const BagMessage message = bag.read(entry);
      const bool read = images.count(bag.topicOf(entry)) > 0
                            ? message.instantiate<sensor_msgs::Image>() != nullptr
                            : message.instantiate<nav_msgs::Odometry>() != nullptr;
      num_messages += read ? 1 : 0;
    }
  }
  state.counters["messages"] = static_cast<double>(num_messages);
}

void compressions(benchmark::internal::Benchmark* benchmark) {
  benchmark->Unit(benchmark::kMillisecond)->ArgName("compression");
  for (const auto compression :
       {rosbag::compression::Uncompressed, rosbag::compression::BZ2, rosbag::compression::LZ4}) {
    benchmark->Arg(compression);
  }
}

BENCHMARK(openByLibrosbag)->Apply(compressions);
BENCHMARK(openByBagReader)->Apply(compressions);
BENCHMARK(readByLibrosbag)->Apply(compressions);
BENCHMARK(readByBagReader)->Apply(compressions);

}  // namespace
}  // namespace vcharge

BENCHMARK_MAIN();
