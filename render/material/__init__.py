"""What surfaces and media do to light: materials, BSDFs, Fresnel, microfacets."""
