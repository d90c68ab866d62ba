#pragma once

#include <iostream>
#include <string>

#include <nlohmann/json.hpp>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_evaluation/report.h"

namespace vcharge {

/// Documents the keys of --json in --help.
inline void describeJson(CommandLine* app, const std::string& keys) {
  app->setFooter("Keys of --json: " + keys +
                 "\nAn error distribution has count, mean, root_mean_square, percentile_50, percentile_68,\n"
                 "percentile_90, percentile_95, percentile_99 and max. A fraction is from 0 to 1.");
}

/// --report of an evaluation tool: a folder for the JSON and its plots.
class ReportArgument {
 public:
  ReportArgument(CommandLine* app, std::string name) : name_(std::move(name)) {
    app->addOption("--report", &folder_, "folder for " + name_ + ".json, as --json, and its plots")
        .check(requireOutputFolder);
  }
  void write(const nlohmann::json& json) const {
    if (!folder_.empty()) {
      writeReport(json, folder_, name_);
    }
  }
  const std::string& folder() const { return folder_; }

 private:
  std::string name_, folder_;
};

/// --options and --show-options of a tool: defaults of an options struct with the overrides of a YAML file.
template <class Options>
class OptionsArgument {
 public:
  explicit OptionsArgument(CommandLine* app) {
    app->addOption("--options", &path_, "YAML with overrides of the options, see --show-options");
    addShowOptions(app, &show_);
  }
  /// Whether the options were printed, so that the tool has nothing else to do.
  bool shown() const {
    if (show_) {
      std::cout << showOptions(read());
    }
    return show_;
  }
  Options read() const {
    Options options;
    if (!path_.empty()) {
      readFieldsFromFile(path_, &options);
    }
    return options;
  }

 private:
  std::string path_;
  bool show_ = false;
};

}  // namespace vcharge
