#pragma once

#include <functional>
#include <string>
#include <vector>

#include "vcharge_core/base/command_line.h"
#include "vcharge_simulation/drive/drive_scenario.h"

namespace vcharge {

/// Command-line options that define a scenario: --scenario FILE.yaml, an option for each common field, and
/// --set KEY=VALUE for any field. Later ones in this list override earlier ones.
class ScenarioCommandLine {
 public:
  /// Adds the options to `app`, which must outlive this object and be parsed before scenario().
  explicit ScenarioCommandLine(CommandLine* app);
  ScenarioCommandLine(const ScenarioCommandLine&) = delete;
  ScenarioCommandLine& operator=(const ScenarioCommandLine&) = delete;

  /// Throws InputError naming the file or option and the key for unknown keys and invalid values.
  DriveScenario scenario() const;

 private:
  template <class T>
  CommandLine::Option add(CommandLine* app, T DriveScenario::*field);

  std::string file_, noise_ = "on";
  std::vector<std::string> settings_;
  DriveScenario given_;  // values of the options other than --scenario and --set
  std::vector<std::function<void(DriveScenario*)>> overrides_;
};

/// Sets a field as in "faults.dead_camera.cameras=[left]". Throws InputError naming --set and the key for an
/// unknown field or an invalid value.
void setField(const std::string& setting, DriveScenario* scenario);

/// One line for each scene, drive, rig and fault.
std::string describeCatalogue();

}  // namespace vcharge
