#include "vcharge_calibration/report/rig_calibration_files.h"

#include <filesystem>
#include <utility>

#include "vcharge_calibration/report/rig_report.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/motion/trajectory.h"

namespace vcharge {

namespace fs = std::filesystem;

namespace {

/// Whether a file is a rig of a calibration whose verdict was PASS.
bool hasPassed(const std::string& rig_file) {
  if (!fs::exists(rig_file)) {
    return false;
  }
  try {
    const CameraRig rig = readCameraRig(rig_file);
    const auto verdict = rig.provenance.find("verdict");
    return rig.hasExtrinsics() && verdict != rig.provenance.end() &&
           verdict->second == toString(Verdict::kPass);
  } catch (const InputError&) {
    return false;  // nothing that could be used
  }
}

}  // namespace

std::string fileBeside(const std::string& path, const std::string& suffix) {
  const fs::path file(path);
  return (file.parent_path() / (file.stem().string() + suffix + file.extension().string())).string();
}

void writeRigReport(const std::string& folder, const std::string& title, const RigCalibration& result,
                    const ReconstructionState& state, const KeyframeImages& images,
                    const std::string& more_sections) {
  if (!folder.empty()) {
    createFolder(folder);
    writeTextFileAtomically((fs::path(folder) / "rig_report.html").string(),
                            makeRigReport(title, result, state, images, more_sections));
  }
}

void writeRigWithMasks(CameraRig rig, std::map<std::string, std::string> provenance,
                       const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  for (const RigCamera& camera : rig.cameras) {
    if (!camera.mask_file.empty()) {
      createFolder((folder / camera.mask_file).parent_path().string());
    }
  }
  rig.provenance = std::move(provenance);
  writeCameraRig(rig, path);
}

std::string writeRigAndTrajectory(const std::string& rig_file, const std::string& trajectory_file,
                                  const RigCalibration& result, const ReconstructionState& state,
                                  const std::map<std::string, std::string>& provenance) {
  check(result.rig != nullptr, "writeRigAndTrajectory: expected a calibration that did not fail");
  if (!trajectory_file.empty()) {
    writeTrajectory(trajectoryOf(state), trajectory_file);
  }
  const std::string path = result.verdict != Verdict::kPass && hasPassed(rig_file)
                               ? fileBeside(rig_file, "_" + toString(result.verdict))
                               : rig_file;
  writeRigWithMasks(*result.rig, provenance, path);
  return path;
}

std::string describeKept(const std::string& rig_file, const std::string& written) {
  return rig_file + " passed and stays; this rig is " + written;
}

}  // namespace vcharge
