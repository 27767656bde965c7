#include "photosphere/core/output_file.h"
#include "photosphere/study/study.h"
#include "tables.h"

namespace photosphere::study {

void writeReport(const StudyResult& result, const StudyOptions& options) {
  writeFile(options.output / "study.csv", csvText(result));
  writeFile(options.output / "study.json", jsonText(result));
}

}  // namespace photosphere::study
