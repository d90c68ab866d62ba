#include "vcharge_calibration/report/monitor_files.h"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <utility>
#include <vector>

#include "vcharge_calibration/report/rig_calibration_files.h"
#include "vcharge_core/base/utc_time.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;

std::string tableOf(const RigMonitor& monitor) {
  std::ostringstream text;
  text.precision(9);
  text << "driven_m,time_s";
  const std::vector<std::string> names = deviationNames(monitor.rig());
  for (const char* const prefix : {"", "sigma of "}) {
    for (const std::string& name : names) {
      text << "," << prefix << name;
    }
  }
  for (const RigCamera& camera : monitor.rig().cameras) {
    text << ",sight of " << camera.name << ",dirt of " << camera.name;
  }
  for (const MonitoredPart& part : monitor.parts()) {
    text << "\n" << part.end_m << "," << toString(part.end);
    for (const Eigen::VectorXd& values : {part.deviation, part.sigmas}) {
      for (Eigen::Index i = 0; i < values.size(); ++i) {
        text << "," << values[i];
      }
    }
    for (size_t i = 0; i < part.sight.size(); ++i) {
      text << "," << part.sight[i] << "," << part.dirt[i];
    }
  }
  return text.str() + "\n";
}

/// Copies a rig that will be replaced, with its date in the name.
void keepOlderFile(const std::string& path) {
  if (!fs::exists(path)) {
    return;
  }
  std::string date = utcNow();
  date.erase(std::remove(date.begin(), date.end(), ':'), date.end());
  writeTextFileAtomically(fileBeside(path, "_until_" + date), readTextFile(path));
}

}  // namespace

void writeMonitorFiles(const std::string& folder, const std::vector<MonitoredDrive>& drives,
                       const RigMonitor& monitor, const MonitorVerdict& verdict) {
  createFolder(folder);
  writeTextFileAtomically((fs::path(folder) / "deviation.csv").string(), tableOf(monitor));
  writeTextFileAtomically((fs::path(folder) / "monitor_report.html").string(),
                          makeMonitorReport(drives, monitor, verdict));
}

void writeRepairedRig(const CameraRig& rig, std::map<std::string, std::string> provenance,
                      const std::string& path) {
  provenance.insert(rig.provenance.begin(), rig.provenance.end());
  provenance["date"] = utcNow();
  keepOlderFile(path);
  writeRigWithMasks(rig, std::move(provenance), path);
}

}  // namespace vcharge
