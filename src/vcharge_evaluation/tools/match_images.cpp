#include <cstdio>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "tool_arguments.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/feature_extractor.h"

namespace {

using namespace vcharge;

cv::Mat readGray(const std::string& path) {
  const cv::Mat image = cv::imread(path, cv::IMREAD_GRAYSCALE);
  if (image.empty()) {
    throw InputError(path + ": expected an image, cannot be read");
  }
  return image;
}

struct PairOfImages {
  size_t first, second;
};

std::vector<PairOfImages> readPairs(const std::vector<std::string>& words, size_t num_images) {
  std::vector<PairOfImages> pairs;
  for (const std::string& word : words) {
    PairOfImages pair{};
    char end = 0;
    if (std::sscanf(word.c_str(), "%zu:%zu%c", &pair.first, &pair.second, &end) != 2 ||
        pair.first >= num_images || pair.second >= num_images) {
      throw InputError("--pairs: expected FIRST:SECOND, numbers of images below " +
                       std::to_string(num_images) + ", got '" + word + "'");
    }
    pairs.push_back(pair);
  }
  return pairs;
}

nlohmann::json toJson(const ImageFeatures& first, const ImageFeatures& second) {
  nlohmann::json matches = nlohmann::json::array();
  for (const FeatureMatch& match : matchDescriptors(first.descriptors, second.descriptors)) {
    const cv::Point2f& from = first.keypoints[static_cast<size_t>(match.first_index)].position_px;
    const cv::Point2f& to = second.keypoints[static_cast<size_t>(match.second_index)].position_px;
    matches.push_back({from.x, from.y, to.x, to.y});
  }
  return matches;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app("Counts the features of images of one camera, and matches those of pairs of images.");
  std::vector<std::string> images, masks, words;
  app.addOption("--images", &images, "images of one size").required();
  app.addOption("--masks", &masks, "one for all images, or one for each: 0 where features are not wanted");
  app.addOption("--pairs", &words, "pairs to match, FIRST:SECOND, counted from 0");
  const OptionsArgument<FeatureExtractorOptions> options(&app);
  app.setFooter(
      "Keys of --json: features: per image; area_px: per image, pixels that the mask allows; matches: per "
      "pair, a list of [x, y, x, y], pixels in both images.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (options.shown()) {
      return;
    }
    const std::unique_ptr<FeatureExtractor> extractor = makeFeatureExtractor(options.read());
    const std::vector<PairOfImages> pairs = readPairs(words, images.size());
    if (masks.size() > 1 && masks.size() != images.size()) {
      throw InputError("--masks: expected one, or one for each of " + std::to_string(images.size()) +
                       " images, got " + std::to_string(masks.size()));
    }
    std::vector<ImageFeatures> features;
    ProgressBar progress("extracting features");
    for (size_t i = 0; i < images.size(); ++i) {
      const cv::Mat image = readGray(images[i]);
      const cv::Mat mask = masks.empty() ? cv::Mat() : readGray(masks[masks.size() == 1 ? 0 : i]);
      features.push_back(extractor->extract(image, mask));
      (*found)["features"].push_back(features.back().size());
      (*found)["area_px"].push_back(mask.empty() ? static_cast<int>(image.total()) : cv::countNonZero(mask));
      progress.update(static_cast<double>(i + 1) / static_cast<double>(images.size()));
    }
    (*found)["matches"] = nlohmann::json::array();
    for (const PairOfImages& pair : pairs) {
      (*found)["matches"].push_back(toJson(features[pair.first], features[pair.second]));
    }
  });
}
