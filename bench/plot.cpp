#include "bench/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>

namespace tessera::bench {
namespace {

// Colours that colour-blind eyes distinguish (Okabe and Ito 2008).
constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7"};

std::string DataBlock(const std::string& name, const std::vector<Offer>& offers) {
  std::string block = fmt::format("${} << EOD\n", name);
  for (const Offer& offer : offers) {
    // A logarithmic axis has no place for 0, and gnuplot none for what is not finite.
    if (std::isfinite(offer.error) && offer.cpu_us > 0) {
      block += fmt::format("{:.9g} {:.9g}\n", offer.cpu_us, std::max(offer.error, 1e-12));
    }
  }
  return block + "EOD\n";
}

std::string Quoted(std::string text) {
  std::erase_if(text, [](char c) { return c == '\'' || c == '\n'; });
  return '\'' + text + '\'';
}

}  // namespace

absl::Status PlotCurves(const std::string& path, const std::string& title, const std::string& error_label,
                        const std::vector<Curve>& curves) {
  std::string data, plots;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const Curve& curve = curves[i];
    if (curve.front.empty()) continue;
    const char* colour = kColours[i % std::size(kColours)];
    data += DataBlock(fmt::format("all{}", i), curve.offers) + DataBlock(fmt::format("front{}", i), curve.front);
    plots +=
        fmt::format("{}$all{} with points pt 7 ps 0.6 lc rgb '{}' notitle, ", plots.empty() ? "" : ", ", i, colour);
    plots += fmt::format("$front{} with linespoints lw 2 pt 7 lc rgb '{}' title {}", i, colour, Quoted(curve.engine));
  }
  if (plots.empty()) return absl::OkStatus();  // no engine came through this scene
  std::FILE* gnuplot = ::popen("gnuplot", "w");
  if (gnuplot == nullptr) return absl::FailedPreconditionError("gnuplot cannot be started");
  const std::string script = fmt::format(
      "set terminal pngcairo size 900,600 noenhanced\nset output {}\nset title {}\nset logscale xy\n"
      "set xlabel 'CPU time, microseconds by simulated 1/60 s'\nset ylabel {}\nset format '%g'\nset grid\n{}plot {}\n",
      Quoted(path), Quoted(title), Quoted(error_label), data, plots);
  std::fputs(script.c_str(), gnuplot);
  if (::pclose(gnuplot) != 0) return absl::FailedPreconditionError(fmt::format("gnuplot could not draw {}", path));
  return absl::OkStatus();
}

std::string PlotPath(const std::string& csv, const std::string& scene) {
  const std::size_t slash = csv.find_last_of('/'), dot = csv.find_last_of('.');
  std::string stem = dot != std::string::npos && (slash == std::string::npos || dot > slash) ? csv.substr(0, dot) : csv;
  stem += '_';
  for (const char c : scene) stem += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return stem + ".png";
}

}  // namespace tessera::bench
