/* skinspec.h - libskinspec: optics, colour and matching of human skin.
 *
 * The library does no input or output and keeps no state; the contract of each
 * part stands in its own header.  Link with `pkg-config --libs skinspec`. */
#ifndef SKINSPEC_H
#define SKINSPEC_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/progress.h" /* how long work tells where it is */
#include "base/spectrum.h" /* a spectrum: bands, values, SCE or SCI */
#include "base/status.h"   /* what functions return */
#include "base/version.h"

#include "optics/chromophores.h" /* melanin, haemoglobin, scattering by wavelength */
#include "optics/dipole.h"       /* Eqs. 7-9 */
#include "optics/half_space.h"
#include "optics/kubelka_munk.h"
#include "optics/model.h" /* all models behind one interface */
#include "optics/monte_carlo.h"
#include "optics/opaque.h" /* an epidermis that lets next to nothing through */
#include "optics/paper.h"  /* the paper's RGB computation */
#include "optics/slopes.h"
#include "optics/tissue.h"
#include "optics/tissue_slopes.h"
#include "optics/transport.h" /* radiative transfer in layers */
#include "optics/two_layer.h"

#include "colour/cie_tables.h" /* observers and illuminants */
#include "colour/delta_e.h"
#include "colour/delta_e_many.h"
#include "colour/lab.h"
#include "colour/srgb.h"
#include "colour/xyz.h"

#include "match/chi_square.h"
#include "match/fit.h"  /* what of a skin is free in a fit */
#include "match/grid.h" /* which skins a table holds */
#include "match/match.h"
#include "match/nearest.h"
#include "match/noise.h"
#include "match/recipe.h"
#include "match/refine.h"        /* a spectrum -> the continuous skin, and how sure */
#include "match/refine_many.h"   /* many spectra at once */
#include "match/refined_match.h" /* the same from the rows of a table on */
#include "match/skin_fit.h"      /* the fit for measured skin */
#include "match/table.h"

#include "plan/costs.h"
#include "plan/plan.h" /* the cheapest way to what a scene wants */
#include "plan/plan_run.h"
#include "plan/scene.h"

#ifdef __cplusplus
}
#endif

#endif
