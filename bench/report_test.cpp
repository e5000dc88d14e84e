#include "bench/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace tessera::bench {
namespace {

TEST(ReportTest, TableHasARowAMetricAndAColumnAConfig) {
  Report report("suite");
  report.Add("scene", "tessera", "n=1", "step", 1.5e-3, "s");
  report.Add("scene", "tessera", "n=2", "step", 2.5e-5, "s");
  report.Add("scene", "tessera", "n=2", "bodies", 12, "1");
  EXPECT_EQ(report.Table(),
            "\nsuite / scene\n"
            "METRIC    n=1   n=2\n"
            "step    1.5ms  25us\n"
            "bodies      -    12\n");
}

TEST(ReportTest, WhatIsSetAgainReplacesWhatWasSaid) {
  Report report("suite");
  report.Set("scene", "tessera", "n=1", "runs", 1, "1");
  report.Set("scene", "tessera", "n=2", "runs", 7, "1");
  report.Set("scene", "tessera", "n=1", "runs", 2, "1");
  ASSERT_EQ(report.figures().size(), 2u);
  EXPECT_EQ(report.figures()[0].value, 2);
  EXPECT_EQ(report.figures()[1].value, 7);
}

TEST(ReportTest, EnginesHaveColumnsOfTheirOwn) {
  Report report("suite");
  report.Add("scene", "tessera", "n=1", "step", 1, "s");
  report.Add("scene", "bullet", "n=1", "step", 2, "s");
  EXPECT_EQ(report.Table(),
            "\nsuite / scene\n"
            "METRIC  tessera n=1  bullet n=1\n"
            "step             1s          2s\n");
}

TEST(ReportTest, CsvHasAFigureALine) {
  const std::string file = testing::TempDir() + "/report_test.csv";
  Report report("suite");
  report.Add("scene", "tessera", "n=1", "step", 0.25, "s");
  report.Add("scene", "tessera", "n=1,m=2", "step", 0.5, "s");
  ASSERT_TRUE(report.WriteCsv(file).ok());
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(text,
            "suite,scene,engine,config,metric,value,unit\n"
            "suite,scene,tessera,n=1,step,0.25,s\n"
            "suite,scene,tessera,\"n=1,m=2\",step,0.5,s\n");
  std::filesystem::remove(file);
}

TEST(ReportTest, AFileThatCannotBeWrittenIsNamed) {
  EXPECT_THAT(std::string(Report("suite").WriteCsv("/nowhere/x.csv").message()), testing::HasSubstr("/nowhere/x.csv"));
}

}  // namespace
}  // namespace tessera::bench
