#pragma once

#include <filesystem>
#include <string>

#include <unistd.h>

#include <nlohmann/json.hpp>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_evaluation/report.h"

namespace vcharge {

/// The outputs of an evaluation tool, --json and where `report_name` is not empty --report, with the keys of
/// the JSON documented in --help.
class OutputArguments {
 public:
  OutputArguments(CLI::App* app, const std::string& keys, std::string report_name = "")
      : report_name_(std::move(report_name)) {
    app->add_option("--json", json_path_, "file for all figures; keys below")->check(requireNotEmpty);
    if (!report_name_.empty()) {
      app->add_option("--report", report_, "folder for the same as " + report_name_ + ".json, and its plots")
          ->check(requireNotEmpty);
    }
    app->footer("JSON:\n" + keys +
                "\nAn error distribution has count, mean, root_mean_square, percentile_50, percentile_68,\n"
                "percentile_90, percentile_95, percentile_99 and max. Suffixes are units; a share is a "
                "fraction from 0 to 1.");
  }

  /// InputError unless the outputs can be written; to be called before the work starts.
  void check() const {
    if (!report_.empty()) {
      std::filesystem::path folder = std::filesystem::absolute(report_);
      while (!std::filesystem::exists(folder)) {
        folder = folder.parent_path();
      }
      requireFolder(folder, report_);
    }
    if (!json_path_.empty()) {
      requireFolder(std::filesystem::absolute(json_path_).parent_path(), json_path_);
    }
  }
  void write(const nlohmann::json& json) const {
    if (!json_path_.empty()) {
      writeJson(json, json_path_);
    }
    if (!report_.empty()) {
      writeReport(json, report_, report_name_);
    }
  }
  const std::string& report() const { return report_; }

 private:
  static void requireFolder(const std::filesystem::path& folder, const std::string& output) {
    if (!std::filesystem::is_directory(folder) || access(folder.c_str(), W_OK | X_OK) != 0) {
      throw InputError(output + ": cannot be written");
    }
  }

  std::string report_name_, report_, json_path_;
};

/// --options of a tool: defaults of an options struct with the overrides of a YAML file.
template <class Options>
class OptionsArgument {
 public:
  explicit OptionsArgument(CLI::App* app) {
    app->add_option("--options", path_, "YAML with overrides of the options, see --show-options");
    app->add_flag("--show-options", show_, "print all options with their values, and do nothing else");
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
