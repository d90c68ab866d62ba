#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "vcharge_simulation/drive/drive_scenario.h"

namespace vcharge {

/// The options of a command line that make up a scenario: --scenario FILE.yaml, an option for each field that
/// is often changed, and --set KEY=VALUE for every field. What is later in this list overrides what is
/// before.
class ScenarioCommandLine {
 public:
  /// Adds the options to `app`, which must outlive this object and must parse before scenario().
  explicit ScenarioCommandLine(CLI::App* app);
  ScenarioCommandLine(const ScenarioCommandLine&) = delete;
  ScenarioCommandLine& operator=(const ScenarioCommandLine&) = delete;

  /// InputError naming the file or option and the key: unknown keys, wrong types and values.
  DriveScenario scenario() const;

 private:
  template <class T>
  CLI::Option* add(CLI::App* app, const std::string& name, T DriveScenario::*field,
                   const std::string& description);

  std::string file_, noise_ = "on";
  std::vector<std::string> settings_;
  DriveScenario given_;  // by options of their own
  std::vector<std::function<void(DriveScenario*)>> overrides_;
};

/// "faults.dead_camera.cameras=[left]" overrides that field. InputError naming --set and the key for anything
/// else than a field of a scenario and a value of its kind.
void setField(const std::string& setting, DriveScenario* scenario);

/// Scenes with their drives, rigs and faults, one line each.
std::string describeCatalogue();

}  // namespace vcharge
