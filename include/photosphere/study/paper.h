#pragma once
// `photosphere study --paper`: the exhibits of Min & Ihm 2010 on the smoke that is shipped.

#include <string>
#include <vector>

#include "photosphere/study/result.h"
#include "photosphere/study/study.h"

namespace photosphere::study {

/// One line of an exhibit: a frame rendered by the settings of the paper, or by its photon map.
struct PaperRow {
  std::string label, settings;
  double paperValue = 0;  ///< [s] or [bytes]; 0 where the paper gives no number
  Spread seconds;         ///< of resolve and march: the paper times rendering, not tracing
  Spread peakMemoryBytes;
  double lightBytes = 0;  ///< that carriers or photons take by their layout, for the memory exhibit
  Estimate meanRatio;     ///< of layer multiple over the reference
  double relativeError = 0;               ///< of layer multiple, all pixels
  bool measured = false, judged = false;  ///< rendered; held against a reference
  std::string why;                        ///< not measured, and why
  image::Image frame;                     ///< R, G, B
};

/// A figure or table of the paper.
struct PaperExhibit {
  std::string name;     ///< "Table 1"
  std::string title;    ///< what it shows
  std::string said;     ///< what the paper says of it
  std::string differs;  ///< why ours differs
  std::string unit;     ///< of paperValue: "s" or "MiB"; empty where it is a picture
  bool pictures = false;
  std::vector<PaperRow> rows;  ///< ratios are over the first
};

struct PaperResult : RunFacts {
  int width = 0, height = 0;
  std::vector<PaperExhibit> exhibits;
};

/// Ratio of a row to the first of its exhibit, ours and the paper's; 0 where there is none.
double ourRatio(const PaperExhibit& exhibit, const PaperRow& row);
double papersRatio(const PaperExhibit& exhibit, const PaperRow& row);

/// Renders every exhibit. `options.scene` is not used: data/studies holds the scenes.
/// @throws InputMissingError where the data of this tool is not found, and as runStudy
PaperResult runPaper(const StudyOptions& options);

/// Writes index.html, paper.csv and paper.json into `options.output`. @throws OutputError
void writePaperReport(const PaperResult& result, const StudyOptions& options);

}  // namespace photosphere::study
