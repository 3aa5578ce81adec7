"""What the rows of a handoff's ledger are called on pages: words for the names that ``ledger.json`` keeps, for both
stages that show it."""

from __future__ import annotations

WORDS = {
    "mass_raw_rel": "mass: grains against source, before any rescaling",
    "mass_total_rel": "mass: grains against source, after rescaling",
    "mass_by_particle_density_rel": "mass: grains at the density of their nearest particle against source",
    "momentum_linear_raw_rel": "linear momentum lost, before the correction",
    "momentum_angular_raw_rel": "angular momentum lost, before the correction",
    "momentum_linear_rel_after": "linear momentum lost, after the correction",
    "momentum_angular_rel_after": "angular momentum lost, after the correction",
    "momentum_local_rel": "linear momentum lost in the worst region, before the correction",
    "momentum_local_after_rel": "linear momentum lost in the worst region, after the correction",
    "correction_max_dv_over_rms_v": "largest change of velocity by the correction / rms velocity",
    "kinetic_energy_change_min": "kinetic energy lost to averaging",
    "kinetic_energy_change_max": "kinetic energy created",
    "kinetic_energy_compact_change": "kinetic energy of compact matter gained or lost",
    "kinetic_energy_ejecta": "kinetic energy of the ejecta",
    "kinetic_energy_bulk": "kinetic energy of the flow that grains resolve",
    "kinetic_energy_peculiar": "kinetic energy of motions smaller than a grain",
    "velocity_field_L2": "velocity field: rms difference / rms velocity",
    "velocity_direction_deg_mean": "velocity field: mean angle between before and after",
    "bulk_density_rel": "bulk density: rms difference",
    "overlap_max_over_r": "largest overlap / radius, in excess of rest",
    "overlap_energy_over_KE": "energy in overlaps / kinetic energy, in excess of rest",
    "overlap_release_speed_over_median_flow": "speed that overlaps would release / median flow speed",
    "cavity_hausdorff_over_r": "cavity: distance of the two surfaces, 99 % of either / grain radius",
    "cavity_volume_rel": "cavity: volume, carved bed against source",
    "cavity_depth_rel": "cavity: mean depth of the floor, carved bed against source",
    "cavity_rim_over_r": "cavity: mean height of the rim, carved bed less source / grain radius",
    "cavity_radius_over_r_DEM_min": "cavity: grains per cavity radius",
    "cavity_radius": "cavity: radius",
    "cavity_depth": "cavity: depth",
    "cavity_volume": "cavity: volume",
    "cavity_off_axis": "cavity: distance of its centre from the axis",
    "ejecta_mass_curve_rel": "ejecta: largest difference of M(>v)",
    "ejecta_mass_in_contact_search": "ejecta: mass that collides from the start",
    "ejecta_mass_ballistic": "ejecta: mass in free flight",
    "ejecta_mass_booked_only": "ejecta: mass that escapes or lands outside the domain (booked only)",
    "ejecta_count": "ejecta: number of grains",
    "ejecta_by_rule": "ejecta: particles of the source by rule",
    "residual_pressure_over_bulk_modulus": "residual pressure / bulk modulus, largest mean over a support",
    "elastic_over_kinetic_energy": "elastic energy discarded / kinetic energy, of compact matter",
    "t_handoff_over_T_crater_max": "time of the handoff / growth time of the crater",
    "bed_residual_speed_over_sqrt_g_r": "speed of the bed at rest / sqrt(g r)",
    "contact_force_p99_over_mean": "contact forces: 99th percentile / mean",
    "mass_outside_domain": "mass outside the domain of the grains",
    "momentum_outside_domain": "linear momentum outside the domain of the grains",
    "angular_momentum_outside_domain": "angular momentum outside the domain of the grains",
    "surface_offset_spacings": "surface outside its particles, in spacings",
    "surface_voids_filled": "closed voids filled when the surface was made",
    "linear_share": "fraction of the velocity gradient inside a particle that grains take over",
    "grains_kept": "grains of the bed that stay",
    "grains_shrunk": "grains made smaller for the loosened matter that they stand for",
    "final_D_change_on_t_handoff_x2": "final diameter: change when the handoff is half or twice as late",
    "final_d_change_on_t_handoff_x2": "final depth: change when the handoff is half or twice as late",
    "final_D_change_on_vcut_x2": "final diameter: change at half or twice the speed limit of ejecta",
    "final_D_change_on_alpha_x1.5": "final diameter: change at another alpha of the surface",
    "control_no_impact_run_drift_over_r": "control run without an impact: largest drift / grain radius",
}


def words(name: str) -> str:
    """A row's name in words; layers carry theirs; a row that is not in the table keeps its name with blanks."""
    if name.startswith("layer_volume_rel_"):
        return (
            f"volume of the layer of {name.removeprefix('layer_volume_rel_').replace('_', ' ')}: grains against source"
        )
    return WORDS.get(name, name.replace("_", " "))
