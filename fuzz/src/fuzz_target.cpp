#include "fuzz_target.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

std::string makeFolder() {
  const std::filesystem::path parent =
      std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path();
  std::string pattern = (parent / "vcharge_fuzz_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) {
    throw std::runtime_error(parent.string() + ": cannot be written");
  }
  return pattern;
}

}  // namespace

ScratchFolder::ScratchFolder() : path_(makeFolder()) {}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string ScratchFolder::write(const std::string& name, const std::string& bytes) const {
  std::string path = path_ + "/" + name;
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return path;
}

std::string bytesOf(const std::string& name, const std::function<void(const std::string& path)>& write) {
  const ScratchFolder folder;
  const std::string path = folder.path() + "/" + name;
  write(path);
  return readTextFile(path);
}

FuzzTarget fileTarget(const std::string& name, const std::string& file_name, std::vector<std::string> seeds,
                      std::function<void(const std::string& path)> read) {
  return {name, [seeds = std::move(seeds)] { return seeds; },
          [file_name, read = std::move(read)](const std::string& bytes) {
            const ScratchFolder folder;
            read(folder.write(file_name, bytes));
          }};
}

bool take(const FuzzTarget& target, const std::string& bytes) {
  try {
    target.read(bytes);
    return true;
  } catch (const InputError&) {
    return false;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

const std::vector<FuzzTarget>& fuzzTargets() {
  static const std::vector<FuzzTarget> targets = [] {
    std::vector<FuzzTarget> all = coreTargets();
    for (const auto& others : {driveTargets(), stageTargets()}) {
      all.insert(all.end(), others.begin(), others.end());
    }
    return all;
  }();
  return targets;
}

const FuzzTarget& fuzzTarget(const std::string& name) {
  for (const FuzzTarget& target : fuzzTargets()) {
    if (target.name == name) {
      return target;
    }
  }
  throw std::out_of_range("there is no fuzz target '" + name + "'");
}

}  // namespace vcharge
