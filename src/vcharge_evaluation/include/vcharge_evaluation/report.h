#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace vcharge {

/// Writes `json` to FOLDER/NAME.json and lets plot_evaluation draw FOLDER/NAME_*.png from it. The folder is
/// created. InputError if that fails; plots that cannot be drawn (no matplotlib) only warn on stderr.
void writeReport(const nlohmann::json& json, const std::string& folder, const std::string& name);

}  // namespace vcharge
