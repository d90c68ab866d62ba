#include <benchmark/benchmark.h>
#include <hwy/targets.h>

#include <opencv2/core/utility.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_features/patch_tracker.h"
#include "vcharge_features/vocabulary_tree.h"

// All benchmarks run on one thread. Descriptor searches find the two nearest and the reverse, 1000 x 1000,
// and are compared with OpenCV's in the same run.
namespace vcharge {
namespace {

cv::Mat randomDescriptors(int rows, int columns, int type, uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat descriptors(rows, columns, type);
  random.fill(descriptors, cv::RNG::UNIFORM, 0, 256);
  return descriptors;
}

void searchByOpenCv(benchmark::State& state, int type, int columns, int norm) {
  cv::setNumThreads(1);
  const auto rows = static_cast<int>(state.range(0));
  const cv::Mat first = randomDescriptors(rows, columns, type, 1);
  const cv::Mat second = randomDescriptors(rows, columns, type, 2);
  const cv::BFMatcher matcher(norm);
  for (auto _ : state) {
    std::vector<std::vector<cv::DMatch>> forward;
    std::vector<cv::DMatch> reverse;
    matcher.knnMatch(first, second, forward, 2);
    matcher.match(second, first, reverse);
    benchmark::DoNotOptimize(forward.data());
    benchmark::DoNotOptimize(reverse.data());
  }
}

void search(benchmark::State& state, int type, int columns, int64_t target) {
  if ((hwy::SupportedTargets() & target) == 0) {
    state.SkipWithError("the processor lacks this instruction set");
    return;
  }
  hwy::SetSupportedTargetsForTest(target);
  const auto rows = static_cast<int>(state.range(0));
  const cv::Mat first = randomDescriptors(rows, columns, type, 1);
  const cv::Mat second = randomDescriptors(rows, columns, type, 2);
  for (auto _ : state) {
    benchmark::DoNotOptimize(findDescriptorNeighbours(first, second).of_first.data());
  }
  hwy::SetSupportedTargetsForTest(0);
}

BENCHMARK_CAPTURE(searchByOpenCv, binary, CV_8UC1, 32, cv::NORM_HAMMING)
    ->Arg(1000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(search, binary_ssse3, CV_8UC1, 32, HWY_SSSE3)->Arg(1000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(search, binary_avx2, CV_8UC1, 32, HWY_AVX2)->Arg(1000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(search, binary_avx512, CV_8UC1, 32, HWY_AVX3_DL)->Arg(1000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(searchByOpenCv, float128, CV_32FC1, 128, cv::NORM_L2)
    ->Arg(1000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(search, float128_ssse3, CV_32FC1, 128, HWY_SSSE3)->Arg(1000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(search, float128_avx2, CV_32FC1, 128, HWY_AVX2)->Arg(1000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(search, float128_avx512, CV_32FC1, 128, HWY_AVX3)->Arg(1000)->Unit(benchmark::kMicrosecond);

cv::Mat makeImage() {
  cv::Mat image(800, 1280, CV_8UC1);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, cv::Size(9, 9), 2.5);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  return image;
}

void extract(benchmark::State& state, FeatureType type) {
  cv::setNumThreads(1);
  FeatureExtractorOptions options;
  options.type = type;
  const auto extractor = makeFeatureExtractor(options);
  const cv::Mat image = makeImage();
  for (auto _ : state) {
    benchmark::DoNotOptimize(extractor->extract(image).keypoints.data());
  }
}
BENCHMARK_CAPTURE(extract, fast_brief, FeatureType::kFastBrief)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(extract, root_sift, FeatureType::kRootSift)->Unit(benchmark::kMillisecond);

void track500Points(benchmark::State& state) {
  cv::setNumThreads(1);
  const cv::Mat image = makeImage();
  const PatchTracker tracker;
  const ImagePyramid previous = tracker.buildPyramid(image(cv::Rect(0, 0, 1270, 790)).clone());
  const cv::Mat next = image(cv::Rect(4, 3, 1270, 790)).clone();
  std::vector<cv::Point2f> points;
  for (int row = 0; row < 20; ++row) {
    for (int column = 0; column < 25; ++column) {
      points.emplace_back(static_cast<float>(50 + 46 * column), static_cast<float>(50 + 34 * row));
    }
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(tracker.track(previous, tracker.buildPyramid(next), points).data());
  }
}
BENCHMARK(track500Points)->Unit(benchmark::kMillisecond);

void wordsOf1000Features(benchmark::State& state) {
  std::vector<cv::Mat> images;
  for (uint64_t i = 0; i < 50; ++i) {
    images.push_back(randomDescriptors(1000, 32, CV_8UC1, i));
  }
  const VocabularyTree tree = VocabularyTree::train(images);
  for (auto _ : state) {
    benchmark::DoNotOptimize(tree.bagOfWords(images[0]).data());
  }
}
BENCHMARK(wordsOf1000Features)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace vcharge

BENCHMARK_MAIN();
