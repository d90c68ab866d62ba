#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "features/drive_features.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_features/vocabulary_tree.h"

namespace {

using namespace vcharge;

struct TrainVocabularyOptions {
  FeatureExtractorOptions extractor;
  VocabularyTreeOptions tree;
  double spacing_m = 1.0;  ///< between the frames that are used

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("extractor", extractor);
    visit("tree", tree);
    visit("spacing_m", spacing_m);
  }
  void validate() const {
    validateInner("extractor", extractor);
    validateInner("tree", tree);
    requireField(spacing_m >= 0.0 && spacing_m <= 1e6, "spacing_m", "must be in [0, 1000000]", spacing_m);
  }
};

struct Arguments {
  std::vector<std::string> bags;
  std::string rig, options, output;
  bool show_options = false;
};

void trainVocabulary(const Arguments& arguments) {
  TrainVocabularyOptions options;
  if (!arguments.options.empty()) {
    readFieldsFromFile(arguments.options, &options);
  }
  if (arguments.show_options) {
    std::cout << writeFields(options) << "\n";
    return;
  }
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  const auto extractor = makeFeatureExtractor(options.extractor);
  std::vector<cv::Mat> images;
  size_t num_descriptors = 0;
  for (const std::string& bag : arguments.bags) {
    for (const FeatureFrame& frame : readDriveFeatures(bag, rig, *extractor, options.spacing_m)) {
      for (const ImageFeatures& features : frame.of_cameras) {
        images.push_back(features.descriptors);
        num_descriptors += features.size();
      }
    }
  }
  if (num_descriptors == 0) {
    throw InputError(arguments.bags.front() + ": no features were found");
  }
  const VocabularyTree tree = VocabularyTree::train(images, options.tree);
  tree.write(arguments.output);
  std::cout << arguments.output << ": " << tree.numWords() << " words from " << num_descriptors
            << " descriptors of " << images.size() << " images\n";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Trains a vocabulary tree for place recognition from the images of drives.");
  Arguments arguments;
  app.add_option("--bag", arguments.bags, "the drives")->required();
  app.add_option("--rig", arguments.rig, "rig.yaml")->required();
  app.add_option("--options", arguments.options, "YAML with overrides of the options");
  app.add_option("--output", arguments.output, "file to write")->required()->check(requireNotEmpty);
  app.add_flag("--show-options", arguments.show_options,
               "print all options with their values, and do nothing else");
  return runTool(&app, argc, argv, [&] { trainVocabulary(arguments); });
}
