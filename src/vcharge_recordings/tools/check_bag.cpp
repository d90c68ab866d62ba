#include <algorithm>
#include <iomanip>
#include <iostream>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_recordings/drive_check.h"
#include "vcharge_recordings/recorded_drive_reader.h"

namespace vcharge {
namespace {

void print(const std::vector<CheckFinding>& findings, bool quiet) {
  size_t width = 0;
  for (const CheckFinding& finding : findings) {
    width = std::max(width, finding.subject.size());
  }
  for (const CheckFinding& finding : findings) {
    if (!quiet || finding.grade != CheckGrade::kPass) {
      std::cout << toString(finding.grade) << "  " << std::left << std::setw(static_cast<int>(width))
                << finding.subject << "  " << finding.what << "\n";
    }
  }
  std::cout << "verdict: " << toString(worstGrade(findings)) << std::endl;
}

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  vcharge::CommandLine app(
      "Judges a recorded drive before hours are spent on it: PASS, WARN or FAIL of each check, with reasons. "
      "The exit status is 0 unless something fails.");
  std::string bag, rig_path;
  bool quiet = false;
  vcharge::DriveTopics topics;
  app.addOption("--bag", &bag, "the drive").required().check(vcharge::requireNotEmpty);
  app.addOption("--rig", &rig_path, "rig.yaml, with extrinsics or without")
      .required()
      .check(vcharge::requireNotEmpty);
  app.addOption("--odometry-topic", &topics.odometry, "topic of the odometry").showDefault();
  app.addOption("--image-topic", &topics.image, "topic of the images").showDefault();
  app.addFlag("--quiet", &quiet, "print only what does not pass");
  app.setFooter("Keys of --json: verdict (PASS, WARN, FAIL), findings (subject, grade, text).");
  return vcharge::runTool(&app, argc, argv, [&](nlohmann::json* found) {
    topics.validate();
    const auto rig = std::make_shared<const vcharge::CameraRig>(vcharge::readCameraRig(rig_path));
    vcharge::DriveChecker checker(rig);
    {
      vcharge::ProgressBar progress("checking " + bag);
      vcharge::readRecordedDrive(bag, *rig, topics, &checker,
                                 [&](double fraction) { progress.update(fraction); });
    }
    const std::vector<vcharge::CheckFinding> findings = checker.findings();
    vcharge::print(findings, quiet);
    *found = {{"verdict", toString(vcharge::worstGrade(findings))}, {"findings", nlohmann::json::array()}};
    for (const vcharge::CheckFinding& finding : findings) {
      (*found)["findings"].push_back(
          {{"subject", finding.subject}, {"grade", toString(finding.grade)}, {"text", finding.what}});
    }
    if (vcharge::worstGrade(findings) == vcharge::CheckGrade::kFail) {
      throw vcharge::InputError(bag + ": the drive is not fit for use");
    }
  });
}
