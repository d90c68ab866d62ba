#include "vcharge_evaluation/report.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <iostream>

#include <nlohmann/json.hpp>

#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace fs = std::filesystem;

void writeReport(const nlohmann::json& json, const std::string& folder, const std::string& name) {
  createFolder(folder);
  const std::string json_path = (fs::path(folder) / (name + ".json")).string();
  writeTextFileAtomically(json_path, json.dump(2) + "\n");

  // The script is installed beside the tools.
  const std::string script = (fs::read_symlink("/proc/self/exe").parent_path() / "plot_evaluation").string();
  std::string arguments[] = {script, json_path};
  char* argv[] = {arguments[0].data(), arguments[1].data(), nullptr};
  pid_t child = 0;
  int status = -1;
  if (posix_spawn(&child, script.c_str(), nullptr, nullptr, argv, environ) != 0 ||
      waitpid(child, &status, 0) != child || status != 0) {
    std::cerr << json_path << ": written, but " << script << " could not draw its plots\n";
  }
}

}  // namespace vcharge
