// Report: the figures of a benchmark run, as people and as programs read them.
//
// One figure a line: suite,scene,engine,config,metric,value,unit. The table on stdout shows the same figures.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace tessera::bench {

struct Figure {
  std::string suite, scene, engine, config, metric;
  double value = 0;
  std::string unit;  // "s", "bytes", "1" for a count or ratio
};

class Report {
 public:
  explicit Report(std::string suite) : suite_(std::move(suite)) {}
  void Add(const std::string& scene, const std::string& engine, const std::string& config, const std::string& metric,
           double value, const std::string& unit);
  // The same, in place of what was said of it before.
  void Set(const std::string& scene, const std::string& engine, const std::string& config, const std::string& metric,
           double value, const std::string& unit);
  // Each Save writes all figures so far to this file, so that a run that is cut short keeps them. Empty: no file.
  void SaveTo(std::string path) { path_ = std::move(path); }
  absl::Status Save() const { return path_.empty() ? absl::OkStatus() : WriteCsv(path_); }
  const std::vector<Figure>& figures() const { return figures_; }

  // Rows are metrics, columns are configs, of each engine if there are several; one block a scene.
  std::string Table() const;
  // Errors: PERMISSION_DENIED naming the file.
  absl::Status WriteCsv(const std::string& path) const;

 private:
  std::string suite_, path_;
  std::vector<Figure> figures_;
};

// "12.3 us", "4.5 ms", "1.2 MB": a value of that unit with three significant digits.
std::string Human(double value, const std::string& unit);

}  // namespace tessera::bench
