#include "vcharge_calibration/report/monitor_files.h"

#include <filesystem>
#include <sstream>
#include <utility>
#include <vector>

#include "vcharge_calibration/report/monitor_report.h"
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
    text << ",sight of " << camera.name;
  }
  for (const MonitoredPart& part : monitor.parts()) {
    text << "\n" << part.end_m << "," << toString(part.end);
    for (const Eigen::VectorXd& values : {part.deviation, part.sigmas}) {
      for (Eigen::Index i = 0; i < values.size(); ++i) {
        text << "," << values[i];
      }
    }
    for (const double value : part.sight) {
      text << "," << value;
    }
  }
  return text.str() + "\n";
}

}  // namespace

void writeMonitorFiles(const std::string& folder, const std::string& title, const RigMonitor& monitor,
                       const MonitorVerdict& verdict) {
  createFolder(folder);
  writeTextFileAtomically((fs::path(folder) / "deviation.csv").string(), tableOf(monitor));
  writeTextFileAtomically((fs::path(folder) / "monitor_report.html").string(),
                          makeMonitorReport(title, monitor, verdict));
}

void writeRepairedRig(const RigMonitor& monitor, const RigRepair& repair,
                      std::map<std::string, std::string> provenance, const std::string& path) {
  std::string evidence;
  for (const RigChange& change : monitor.changes()) {
    evidence += (evidence.empty() ? "" : "; ") + describeChange(monitor.rig(), change);
  }
  provenance["evidence"] = evidence;
  provenance["date"] = utcNow();
  writeRigWithMasks(*repair.rig, std::move(provenance), path);
}

}  // namespace vcharge
