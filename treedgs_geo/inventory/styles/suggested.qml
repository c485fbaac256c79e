<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis simplifyAlgorithm="0" maxScale="0" simplifyDrawingTol="1" symbologyReferenceScale="-1" readOnly="0" simplifyMaxScale="1" version="3.22.16-Białowieża" simplifyDrawingHints="1" hasScaleBasedVisibilityFlag="0" styleCategories="LayerConfiguration|Symbology|Labeling|Fields|Forms|MapTips|AttributeTable|Rendering" minScale="100000000" labelsEnabled="0" simplifyLocal="1">
  <flags>
    <Identifiable>1</Identifiable>
    <Removable>1</Removable>
    <Searchable>1</Searchable>
    <Private>0</Private>
  </flags>
  <renderer-v2 symbollevels="0" forceraster="0" referencescale="-1" type="singleSymbol" enableorderby="0">
    <symbols>
      <symbol clip_to_extent="1" name="0" alpha="1" type="line" force_rhr="0">
        <data_defined_properties>
          <Option type="Map">
            <Option value="" name="name" type="QString"/>
            <Option name="properties"/>
            <Option value="collection" name="type" type="QString"/>
          </Option>
        </data_defined_properties>
        <layer locked="0" enabled="1" pass="0" class="SimpleLine">
          <Option type="Map">
            <Option value="0" name="align_dash_pattern" type="QString"/>
            <Option value="square" name="capstyle" type="QString"/>
            <Option value="5;2" name="customdash" type="QString"/>
            <Option value="3x:0,0,0,0,0,0" name="customdash_map_unit_scale" type="QString"/>
            <Option value="MM" name="customdash_unit" type="QString"/>
            <Option value="0" name="dash_pattern_offset" type="QString"/>
            <Option value="3x:0,0,0,0,0,0" name="dash_pattern_offset_map_unit_scale" type="QString"/>
            <Option value="MM" name="dash_pattern_offset_unit" type="QString"/>
            <Option value="0" name="draw_inside_polygon" type="QString"/>
            <Option value="bevel" name="joinstyle" type="QString"/>
            <Option value="106,61,154,255" name="line_color" type="QString"/>
            <Option value="dash" name="line_style" type="QString"/>
            <Option value="0.6" name="line_width" type="QString"/>
            <Option value="MM" name="line_width_unit" type="QString"/>
            <Option value="0" name="offset" type="QString"/>
            <Option value="3x:0,0,0,0,0,0" name="offset_map_unit_scale" type="QString"/>
            <Option value="MM" name="offset_unit" type="QString"/>
            <Option value="0" name="ring_filter" type="QString"/>
            <Option value="0" name="trim_distance_end" type="QString"/>
            <Option value="3x:0,0,0,0,0,0" name="trim_distance_end_map_unit_scale" type="QString"/>
            <Option value="MM" name="trim_distance_end_unit" type="QString"/>
            <Option value="0" name="trim_distance_start" type="QString"/>
            <Option value="3x:0,0,0,0,0,0" name="trim_distance_start_map_unit_scale" type="QString"/>
            <Option value="MM" name="trim_distance_start_unit" type="QString"/>
            <Option value="0" name="tweak_dash_pattern_on_corners" type="QString"/>
            <Option value="0" name="use_custom_dash" type="QString"/>
            <Option value="3x:0,0,0,0,0,0" name="width_map_unit_scale" type="QString"/>
          </Option>
          <prop v="0" k="align_dash_pattern"/>
          <prop v="square" k="capstyle"/>
          <prop v="5;2" k="customdash"/>
          <prop v="3x:0,0,0,0,0,0" k="customdash_map_unit_scale"/>
          <prop v="MM" k="customdash_unit"/>
          <prop v="0" k="dash_pattern_offset"/>
          <prop v="3x:0,0,0,0,0,0" k="dash_pattern_offset_map_unit_scale"/>
          <prop v="MM" k="dash_pattern_offset_unit"/>
          <prop v="0" k="draw_inside_polygon"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="106,61,154,255" k="line_color"/>
          <prop v="dash" k="line_style"/>
          <prop v="0.6" k="line_width"/>
          <prop v="MM" k="line_width_unit"/>
          <prop v="0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="0" k="ring_filter"/>
          <prop v="0" k="trim_distance_end"/>
          <prop v="3x:0,0,0,0,0,0" k="trim_distance_end_map_unit_scale"/>
          <prop v="MM" k="trim_distance_end_unit"/>
          <prop v="0" k="trim_distance_start"/>
          <prop v="3x:0,0,0,0,0,0" k="trim_distance_start_map_unit_scale"/>
          <prop v="MM" k="trim_distance_start_unit"/>
          <prop v="0" k="tweak_dash_pattern_on_corners"/>
          <prop v="0" k="use_custom_dash"/>
          <prop v="3x:0,0,0,0,0,0" k="width_map_unit_scale"/>
          <data_defined_properties>
            <Option type="Map">
              <Option value="" name="name" type="QString"/>
              <Option name="properties"/>
              <Option value="collection" name="type" type="QString"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
    </symbols>
    <rotation/>
    <sizescale/>
  </renderer-v2>
  <blendMode>0</blendMode>
  <featureBlendMode>0</featureBlendMode>
  <layerOpacity>1</layerOpacity>
  <fieldConfiguration>
    <field configurationFlags="None" name="plot_id">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="field_id">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="tree_id">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="field_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="dbh_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="delta_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="dbh_lo_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="dbh_hi_cm">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="qc_flag">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="dist_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="margin">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="pair_status">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="note">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" name="Plot" field="plot_id"/>
    <alias index="1" name="Field tree" field="field_id"/>
    <alias index="2" name="Measured tree" field="tree_id"/>
    <alias index="3" name="Field DBH [cm]" field="field_cm"/>
    <alias index="4" name="Measured DBH [cm]" field="dbh_cm"/>
    <alias index="5" name="Measured - field DBH [cm]" field="delta_cm"/>
    <alias index="6" name="DBH, lower end of 90 % interval [cm]" field="dbh_lo_cm"/>
    <alias index="7" name="DBH, upper end of 90 % interval [cm]" field="dbh_hi_cm"/>
    <alias index="8" name="Quality" field="qc_flag"/>
    <alias index="9" name="Distance after co-registration [m]" field="dist_m"/>
    <alias index="10" name="Log-odds against the next best pairing" field="margin"/>
    <alias index="11" name="Pair status" field="pair_status"/>
    <alias index="12" name="Note" field="note"/>
  </aliases>
  <defaults>
    <default expression="" applyOnUpdate="0" field="plot_id"/>
    <default expression="" applyOnUpdate="0" field="field_id"/>
    <default expression="" applyOnUpdate="0" field="tree_id"/>
    <default expression="" applyOnUpdate="0" field="field_cm"/>
    <default expression="" applyOnUpdate="0" field="dbh_cm"/>
    <default expression="" applyOnUpdate="0" field="delta_cm"/>
    <default expression="" applyOnUpdate="0" field="dbh_lo_cm"/>
    <default expression="" applyOnUpdate="0" field="dbh_hi_cm"/>
    <default expression="" applyOnUpdate="0" field="qc_flag"/>
    <default expression="" applyOnUpdate="0" field="dist_m"/>
    <default expression="" applyOnUpdate="0" field="margin"/>
    <default expression="" applyOnUpdate="0" field="pair_status"/>
    <default expression="" applyOnUpdate="0" field="note"/>
  </defaults>
  <constraints>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="plot_id"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="field_id"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="tree_id"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="field_cm"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="dbh_cm"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="delta_cm"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="dbh_lo_cm"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="dbh_hi_cm"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="qc_flag"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="dist_m"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="margin"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="pair_status"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="note"/>
  </constraints>
  <constraintExpressions>
    <constraint exp="" desc="" field="plot_id"/>
    <constraint exp="" desc="" field="field_id"/>
    <constraint exp="" desc="" field="tree_id"/>
    <constraint exp="" desc="" field="field_cm"/>
    <constraint exp="" desc="" field="dbh_cm"/>
    <constraint exp="" desc="" field="delta_cm"/>
    <constraint exp="" desc="" field="dbh_lo_cm"/>
    <constraint exp="" desc="" field="dbh_hi_cm"/>
    <constraint exp="" desc="" field="qc_flag"/>
    <constraint exp="" desc="" field="dist_m"/>
    <constraint exp="" desc="" field="margin"/>
    <constraint exp="" desc="" field="pair_status"/>
    <constraint exp="" desc="" field="note"/>
  </constraintExpressions>
  <expressionfields/>
  <attributetableconfig actionWidgetStyle="dropDown" sortOrder="0" sortExpression="">
    <columns/>
  </attributetableconfig>
  <conditionalstyles>
    <rowstyles/>
    <fieldstyles/>
  </conditionalstyles>
  <storedexpressions/>
  <editform tolerant="1"></editform>
  <editforminit/>
  <editforminitcodesource>0</editforminitcodesource>
  <editforminitfilepath></editforminitfilepath>
  <editforminitcode><![CDATA[]]></editforminitcode>
  <featformsuppress>0</featformsuppress>
  <editorlayout>generatedlayout</editorlayout>
  <editable/>
  <labelOnTop/>
  <reuseLastValue/>
  <dataDefinedFieldProperties/>
  <widgets/>
  <previewExpression>"plot_id" || ': ' || "field_id" || ' - ' || "tree_id"</previewExpression>
  <mapTip>Field tree [% "field_id" %], measured tree [% "tree_id" %]?&lt;br>[% "note" %]</mapTip>
  <layerGeometryType>1</layerGeometryType>
</qgis>
